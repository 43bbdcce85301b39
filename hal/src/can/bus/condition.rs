//! Error frames of SocketCAN (`linux/can/error.h`): conditions that the controller reports.
//!
//! ```text
//! can_id   CAN_ERR_FLAG | class bits: 0x004 controller, 0x020 no acknowledge, 0x040 bus-off, 0x100 restarted, ...
//! data[1]  controller: 0x03 overflow, 0x0C warning level, 0x30 error passive, 0x40 error active again
//! ```

/// The condition in an error frame; the most severe one if there are several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// The controller has left the bus: nothing is sent, although writes succeed.
    BusOff,
    /// 128 or more errors: the controller may no longer signal errors to other nodes.
    Passive,
    /// Frames were lost in the controller or in the host.
    Overflow,
    /// 96 or more errors.
    Warning,
    /// No node acknowledged a frame.
    NoAcknowledge,
    /// Error active again: normal operation.
    Active,
    /// A single error on the bus; the controller repeats the frame.
    Noise,
}

const CONTROLLER: u32 = 0x004;
const NO_ACKNOWLEDGE: u32 = 0x020;
const BUS_OFF: u32 = 0x040;
const BUS_ERROR: u32 = 0x080;
const RESTARTED: u32 = 0x100;

impl Condition {
    /// Decodes the class bits and data of an error frame.
    pub fn decode(class: u32, data: &[u8]) -> Condition {
        let controller = if class & CONTROLLER != 0 {
            data.get(1).copied().unwrap_or(0)
        } else {
            0
        };
        match () {
            () if class & BUS_OFF != 0 => Condition::BusOff,
            () if controller & 0x30 != 0 => Condition::Passive,
            () if controller & 0x03 != 0 => Condition::Overflow,
            () if controller & 0x0C != 0 => Condition::Warning,
            () if class & NO_ACKNOWLEDGE != 0 => Condition::NoAcknowledge,
            () if controller & 0x40 != 0 || class & RESTARTED != 0 => Condition::Active,
            () => Condition::Noise,
        }
    }
}

impl Condition {
    /// Class bits and data of an error frame with this condition.
    pub fn encode(self) -> (u32, [u8; 8]) {
        let controller = |bits: u8| (CONTROLLER, [0, bits, 0, 0, 0, 0, 0, 0]);
        match self {
            Condition::BusOff => (BUS_OFF, [0; 8]),
            Condition::Passive => controller(0x30),
            Condition::Overflow => controller(0x03),
            Condition::Warning => controller(0x0C),
            Condition::NoAcknowledge => (NO_ACKNOWLEDGE, [0; 8]),
            Condition::Active => (RESTARTED, [0; 8]),
            Condition::Noise => (BUS_ERROR, [0; 8]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decodes_the_bits_of_linux_can_error_h() {
        let cases = [
            (0x040, [0; 8], Condition::BusOff),
            (0x004, [0, 0x20, 0, 0, 0, 0, 0, 0], Condition::Passive),
            (0x004, [0, 0x10, 0, 0, 0, 0, 0, 0], Condition::Passive),
            (0x004, [0, 0x08, 0, 0, 0, 0, 0, 0], Condition::Warning),
            (0x004, [0, 0x01, 0, 0, 0, 0, 0, 0], Condition::Overflow),
            (0x004, [0, 0x40, 0, 0, 0, 0, 0, 0], Condition::Active),
            (0x100, [0; 8], Condition::Active),
            (0x020, [0; 8], Condition::NoAcknowledge),
            (0x088, [0; 8], Condition::Noise),
            (0x044, [0, 0x40, 0, 0, 0, 0, 0, 0], Condition::BusOff),
        ];
        for (class, data, condition) in cases {
            assert_eq!(
                Condition::decode(class, &data),
                condition,
                "class {class:#x} {data:?}"
            );
        }
        assert_eq!(
            Condition::decode(0x004, &[]),
            Condition::Noise,
            "the byte is missing"
        );
    }

    #[test]
    fn encode_and_decode_are_inverse() {
        use Condition::*;
        for condition in [
            BusOff,
            Passive,
            Overflow,
            Warning,
            NoAcknowledge,
            Active,
            Noise,
        ] {
            let (class, data) = condition.encode();
            assert_eq!(Condition::decode(class, &data), condition);
        }
    }
}
