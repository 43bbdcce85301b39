//! The USB adapter of a serial port, by sysfs.

use std::path::Path;

use super::finding::read_line;

/// The adapter of a port.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Usb {
    /// Vendor, four hexadecimal digits.
    pub vendor: String,
    /// Product, four hexadecimal digits.
    pub product: String,
    /// Serial number, if the adapter has one.
    pub serial: Option<String>,
    /// Latency timer of an FTDI adapter in milliseconds: the longest time for which it collects bytes.
    pub latency_ms: Option<u32>,
}

impl Usb {
    /// The adapter of the terminal `name` (`ttyUSB0`); `None` for other terminals. `class` is `/sys/class/tty`.
    pub fn of(class: &Path, name: &str) -> Option<Usb> {
        let device = class.join(name).join("device").canonicalize().ok()?;
        let usb = device
            .ancestors()
            .find(|folder| folder.join("idVendor").exists())?;
        Some(Usb {
            vendor: read_line(usb.join("idVendor"))?,
            product: read_line(usb.join("idProduct"))?,
            serial: read_line(usb.join("serial")),
            latency_ms: read_line(device.join("latency_timer")).and_then(|text| text.parse().ok()),
        })
    }

    /// A udev rule that gives `group` and the user at the console access to this adapter.
    pub fn rule(&self, group: &str) -> String {
        let Usb {
            vendor, product, ..
        } = self;
        let serial = self.serial.as_ref().map_or(String::new(), |serial| {
            format!("ATTRS{{serial}}==\"{serial}\", ")
        });
        format!(
            "SUBSYSTEM==\"tty\", ATTRS{{idVendor}}==\"{vendor}\", ATTRS{{idProduct}}==\"{product}\", {serial}\
             GROUP=\"{group}\", MODE=\"0660\", TAG+=\"uaccess\""
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_adapter_of_a_terminal() {
        let sys = tempfile::tempdir().unwrap();
        let usb = sys.path().join("devices/usb1/1-2");
        let port = usb.join("1-2:1.0/ttyUSB0");
        std::fs::create_dir_all(&port).unwrap();
        for (file, text) in [
            ("idVendor", "0403\n"),
            ("idProduct", "6001\n"),
            ("serial", "A6004xyz\n"),
        ] {
            std::fs::write(usb.join(file), text).unwrap();
        }
        std::fs::write(port.join("latency_timer"), "16\n").unwrap();
        let class = sys.path().join("class/tty");
        std::fs::create_dir_all(class.join("ttyUSB0")).unwrap();
        std::fs::create_dir_all(class.join("ttyS0")).unwrap();
        std::os::unix::fs::symlink(&port, class.join("ttyUSB0/device")).unwrap();
        let found = Usb::of(&class, "ttyUSB0").unwrap();
        assert_eq!(
            (found.vendor.as_str(), found.latency_ms),
            ("0403", Some(16))
        );
        assert_eq!(
            found.rule("dialout"),
            "SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"0403\", ATTRS{idProduct}==\"6001\", ATTRS{serial}==\"A6004xyz\", \
             GROUP=\"dialout\", MODE=\"0660\", TAG+=\"uaccess\""
        );
        assert_eq!(Usb::of(&class, "ttyS0"), None);
        assert_eq!(Usb::of(&class, "ttyUSB9"), None);
    }
}
