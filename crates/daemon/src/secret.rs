//! Random secrets: tokens, leases, tickets.

use std::fmt;

/// 128 random bits as hexadecimal text. It is not shown in logs.
#[derive(Clone)]
pub struct Secret(String);

impl Secret {
    /// A new secret from the random generator of the system.
    ///
    /// # Errors
    /// When the system has no random numbers.
    pub fn random() -> Result<Secret, getrandom::Error> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes)?;
        let digits = bytes.iter().map(|byte| format!("{byte:02x}"));
        Ok(Secret(digits.collect()))
    }

    /// A secret that was stored or received.
    pub fn known(text: String) -> Secret {
        Secret(text)
    }

    /// The text, to be given to its owner.
    pub fn reveal(&self) -> &str {
        &self.0
    }

    /// Whether `text` is the secret. The time does not depend on the number of equal characters.
    pub fn is(&self, text: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), text.as_bytes());
        let difference = own.iter().zip(other).fold(0, |sum, (a, b)| sum | (a ^ b));
        own.len() == other.len() && difference == 0
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Secret(...)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accepts_only_the_same_text() {
        let secret = Secret::known("0123456789abcdef".into());
        assert!(secret.is("0123456789abcdef"));
        for other in [
            "",
            "0123456789abcdee",
            "0123456789abcdef0",
            "0123456789ABCDEF",
        ] {
            assert!(!secret.is(other), "{other}");
        }
    }

    #[test]
    fn debug_text_does_not_contain_it() {
        let secret = Secret::random().expect("random numbers");
        assert_eq!(secret.reveal().len(), 32);
        assert!(!format!("{secret:?}").contains(secret.reveal()));
    }
}
