//! A digest that is equal for two runs that are equal bit for bit.

/// A running 64-bit hash of messages: for each 8 bytes `w`, `h = (rotate_left(h, 5) ^ w) * K` modulo 2^64.
///
/// Each step is one-to-one in `h` and in `w`, so two sequences that differ in a single word never have the same digest. It does
/// not protect against forgery. The definition is fixed: digests of different versions and machines can be compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Digest(u64);

impl Digest {
    /// Adds a message: its channel and length, then its bytes, with the last word padded with zeros.
    pub(super) fn add(&mut self, channel: u8, message: &[u8]) {
        self.word(u64::from(channel) << 56 ^ message.len() as u64);
        let (words, rest) = message.as_chunks::<8>();
        words.iter().for_each(|w| self.word(u64::from_le_bytes(*w)));
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.word(u64::from_le_bytes(last));
    }

    /// The digest of all messages so far.
    pub(super) fn value(self) -> u64 {
        self.0
    }

    fn word(&mut self, word: u64) {
        // K is odd, so the multiplication is invertible.
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x517c_c1b7_2722_0a95);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digest(messages: &[&[u8]]) -> u64 {
        let mut digest = Digest::default();
        messages.iter().for_each(|m| digest.add(1, m));
        digest.value()
    }

    #[test]
    fn every_single_bit_of_a_message_changes_the_digest() {
        let message: Vec<u8> = (0..83).collect();
        for bit in 0..8 * message.len() {
            let mut altered = message.clone();
            altered[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(
                digest(&[&message, &[7]]),
                digest(&[&altered, &[7]]),
                "bit {bit}"
            );
        }
    }

    #[test]
    fn order_boundaries_and_trailing_zeros_of_messages_count() {
        assert_ne!(digest(&[b"one", b"two"]), digest(&[b"two", b"one"]));
        assert_ne!(digest(&[b"one", b"two"]), digest(&[b"onet", b"wo"]));
        assert_ne!(digest(&[b"one"]), digest(&[b"one\0"]));
        assert_ne!(digest(&[b""]), digest(&[]));
        assert_eq!(digest(&[b"one", b"two"]), digest(&[b"one", b"two"]));
    }

    #[test]
    fn digest_depends_on_the_channel() {
        let (mut a, mut b) = (Digest::default(), Digest::default());
        a.add(1, b"bytes");
        b.add(2, b"bytes");
        assert_ne!(a.value(), b.value());
    }
}
