//! Resident memory and file descriptors of this process.

use std::io;

/// Growth of the resident memory after the warm-up that is accepted, in bytes. A leak of 28 kB per period exceeds it in a soak of
/// 10^8 ticks; the memory allocator itself moves by less.
const MAX_GROWTH_BYTES: u64 = 8 << 20;

/// Resources at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Resources {
    /// Resident memory in bytes.
    pub resident_bytes: u64,
    /// Open file descriptors.
    pub descriptors: u64,
}

impl Resources {
    /// The resources now.
    pub fn now() -> io::Result<Resources> {
        Ok(Resources {
            resident_bytes: resident_bytes()?,
            descriptors: std::fs::read_dir("/proc/self/fd")?.count() as u64,
        })
    }

    /// The larger of both, value by value.
    pub fn max(self, other: Resources) -> Resources {
        Resources {
            resident_bytes: self.resident_bytes.max(other.resident_bytes),
            descriptors: self.descriptors.max(other.descriptors),
        }
    }

    /// What has grown since the warm-up, as text.
    pub fn growth_since(self, warm: Resources) -> Option<String> {
        let grew = self.resident_bytes > warm.resident_bytes + MAX_GROWTH_BYTES
            || self.descriptors > warm.descriptors;
        grew.then(|| {
            format!(
                "grew from {warm} to {self} since the warm-up; {:.0} MB and no descriptor are accepted",
                MAX_GROWTH_BYTES as f64 / 1e6
            )
        })
    }
}

impl std::fmt::Display for Resources {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:.2} MB resident, {} descriptors",
            self.resident_bytes as f64 / 1e6,
            self.descriptors
        )
    }
}

/// `VmRSS` of the kernel.
fn resident_bytes() -> io::Result<u64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let value = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = value.and_then(|value| value.trim().strip_suffix(" kB"));
    let kilobytes = kilobytes.and_then(|number| number.parse::<u64>().ok());
    let missing = || io::Error::other("/proc/self/status has no VmRSS in kB");
    Ok(kilobytes.ok_or_else(missing)? * 1024)
}
