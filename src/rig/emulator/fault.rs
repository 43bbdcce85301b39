//! Faults in words: `amplifier.late=50ms`, `probe.stuck`, `none`.

use bench_hal::can::emulator::DeviceFault;
use bench_hal::serial::emulator::Fault;

use crate::util::quantity::Length;

/// What an acting device is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EmulatedFault {
    /// All devices are sound again.
    None,
    /// Of the amplifier.
    Amplifier(AmplifierFault),
    /// Of the probe.
    Probe(Fault),
}

/// A fault of the amplifier, or of the bus that it is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AmplifierFault {
    /// Of the device.
    Device(DeviceFault),
    /// The other end's controller is in bus-off: it is told so, and the device hears and says nothing.
    BusOff,
}

/// Words that are no fault.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FaultError {
    /// No such kind.
    #[error("there is no fault `{word}`; there are {}", words())]
    Unknown {
        /// What was said.
        word: String,
    },
    /// A value that makes no sense.
    #[error("{word}={value}: it must be {wants}")]
    Value {
        /// The kind.
        word: String,
        /// The value.
        value: String,
        /// What it must be.
        wants: &'static str,
    },
}

/// Word, the value if none is said (empty: it has none), and what happens.
const KINDS: [(&str, &str, &str); 23] = [
    ("none", "", "both devices are sound again"),
    ("amplifier.none", "", "sound again"),
    ("amplifier.silence", "", "sends nothing, but hears"),
    ("amplifier.unplugged", "", "neither sends nor hears"),
    (
        "amplifier.short-frames",
        "",
        "status frames of a wrong length",
    ),
    (
        "amplifier.senseless-status",
        "",
        "statuswords that no state has",
    ),
    (
        "amplifier.fault",
        "0x2310",
        "the power stage fails: emergency message, then the state Fault",
    ),
    (
        "amplifier.emergency",
        "0x4210",
        "an emergency message without a change of state",
    ),
    (
        "amplifier.target-ignored",
        "",
        "enabled, but the target is not followed (bit 12)",
    ),
    (
        "amplifier.set-points-ignored",
        "",
        "takes no set-points, but obeys NMT",
    ),
    (
        "amplifier.orders-ignored",
        "",
        "takes neither set-points nor NMT",
    ),
    (
        "amplifier.switches-off",
        "",
        "switches itself off without a fault",
    ),
    ("amplifier.late", "50ms", "sends everything so much later"),
    ("amplifier.reset", "", "restarts as after a loss of power"),
    (
        "amplifier.bus-off",
        "",
        "the other end is told that it is in bus-off, nothing passes (virtual interfaces only)",
    ),
    ("probe.none", "", "sound again"),
    ("probe.silence", "", "sends nothing"),
    ("probe.corrupt", "1", "one byte in so many is another byte"),
    ("probe.stuck", "", "sends one value for ever, as new"),
    ("probe.jump", "50um", "every second value lies so far away"),
    ("probe.out-of-range", "", "the target is out of range"),
    ("probe.late", "50ms", "sends everything so much later"),
    ("probe.reset", "", "restarts: its counter begins again"),
];

/// The list of all kinds, a line each.
pub fn help() -> String {
    let line = |(word, value, what): &(&str, &str, &str)| {
        let value = if value.is_empty() {
            String::new()
        } else {
            format!("[={value}]")
        };
        format!("  {:<30} {what}\n", format!("{word}{value}"))
    };
    KINDS.iter().map(line).collect()
}

/// The whole word of a fault whose device was left out, where only one of the devices `served` can have it.
pub fn whole(word: &str, served: &[String]) -> String {
    let kind = word.split('=').next().unwrap_or(word);
    let known = |device: &&String| {
        KINDS
            .iter()
            .any(|(whole, ..)| *whole == format!("{device}.{kind}"))
    };
    match served.iter().filter(known).collect::<Vec<_>>()[..] {
        [device] if kind != "none" => format!("{device}.{word}"),
        _ => word.into(),
    }
}

fn words() -> String {
    KINDS.map(|(word, ..)| word).join(", ")
}

impl EmulatedFault {
    /// Reads the words of a fault: `KIND` or `KIND=VALUE`.
    pub fn parse(text: &str) -> Result<EmulatedFault, FaultError> {
        let (word, said) = text
            .split_once('=')
            .map_or((text, None), |(word, value)| (word, Some(value)));
        let unknown = || FaultError::Unknown { word: word.into() };
        let (_, usual, _) = KINDS
            .iter()
            .find(|(kind, ..)| *kind == word)
            .ok_or_else(unknown)?;
        let value = said.unwrap_or(usual);
        let refused = |wants| FaultError::Value {
            word: word.into(),
            value: value.into(),
            wants,
        };
        if said.is_some() && usual.is_empty() {
            return Err(refused("left out: this fault has no value"));
        }
        if word == "none" {
            return Ok(EmulatedFault::None);
        }
        let amplifier = |fault| EmulatedFault::Amplifier(AmplifierFault::Device(fault));
        match word.split_once('.') {
            Some(("amplifier", "bus-off")) => Ok(EmulatedFault::Amplifier(AmplifierFault::BusOff)),
            Some(("amplifier", kind)) => of_amplifier(kind, value).map(amplifier).map_err(refused),
            Some((_, kind)) => of_probe(kind, value)
                .map(EmulatedFault::Probe)
                .map_err(refused),
            None => Err(unknown()),
        }
    }

    /// What ends this fault.
    pub fn end(self) -> EmulatedFault {
        match self {
            EmulatedFault::None => EmulatedFault::None,
            EmulatedFault::Amplifier(_) => {
                EmulatedFault::Amplifier(AmplifierFault::Device(DeviceFault::None))
            }
            EmulatedFault::Probe(_) => EmulatedFault::Probe(Fault::None),
        }
    }
}

fn of_amplifier(kind: &str, value: &str) -> Result<DeviceFault, &'static str> {
    Ok(match kind {
        "silence" => DeviceFault::Mute,
        "unplugged" => DeviceFault::Unplugged,
        "short-frames" => DeviceFault::ShortFrames,
        "senseless-status" => DeviceFault::InvalidStatusword,
        "fault" => DeviceFault::Drive(code(value)?),
        "emergency" => DeviceFault::EmergencyOnly(code(value)?),
        "target-ignored" => DeviceFault::TargetIgnored,
        "set-points-ignored" => DeviceFault::SetPointsIgnored,
        "orders-ignored" => DeviceFault::CommandsIgnored,
        "switches-off" => DeviceFault::SwitchesOff,
        "late" => DeviceFault::Late(nanoseconds(value)? / 1_000_000),
        "reset" => DeviceFault::Reset,
        _ => DeviceFault::None,
    })
}

fn of_probe(kind: &str, value: &str) -> Result<Fault, &'static str> {
    Ok(match kind {
        "silence" => Fault::Silence,
        "corrupt" => {
            let every = value.parse().ok().filter(|every| *every > 0);
            Fault::Corrupt {
                every: every.ok_or("a whole number of bytes, above zero")?,
            }
        }
        "stuck" => Fault::Stuck,
        "jump" => {
            let by: Length = (value.parse()).map_err(|_| "a length (50um, 0.5mm, or metres)")?;
            Fault::Jump {
                every: 2,
                by_m: by.si(),
            }
        }
        "out-of-range" => Fault::OutOfRange,
        "late" => Fault::Late {
            by_ns: nanoseconds(value)?,
        },
        "reset" => Fault::Reset,
        _ => Fault::None,
    })
}

/// An emergency code: hexadecimal with 0x, or decimal.
fn code(text: &str) -> Result<u16, &'static str> {
    let hexadecimal = text.strip_prefix("0x").or(text.strip_prefix("0X"));
    let number = hexadecimal.map_or_else(|| text.parse(), |digits| u16::from_str_radix(digits, 16));
    number
        .ok()
        .filter(|code| *code > 0)
        .ok_or("an emergency code from 0x0001 to 0xFFFF")
}

/// A time like `50ms`, an hour at most.
fn nanoseconds(text: &str) -> Result<u64, &'static str> {
    const WANTS: &str = "a time with its unit (50ms, 200us, 1s), an hour at most";
    let time = humantime::parse_duration(text).map_err(|_| WANTS)?;
    if time.as_secs() <= 3600 {
        Ok(time.as_nanos() as u64)
    } else {
        Err(WANTS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_another_fault_and_is_in_the_help() {
        let faults: Vec<EmulatedFault> = KINDS
            .map(|(word, ..)| EmulatedFault::parse(word).expect(word))
            .to_vec();
        for (index, fault) in faults.iter().enumerate() {
            assert!(!faults[..index].contains(fault), "{}", KINDS[index].0);
            assert!(help().contains(KINDS[index].0));
        }
    }

    #[test]
    fn values_are_read_in_the_units_that_a_person_writes() {
        let amplifier = |fault| Ok(EmulatedFault::Amplifier(AmplifierFault::Device(fault)));
        assert_eq!(
            EmulatedFault::parse("amplifier.late=250ms"),
            amplifier(DeviceFault::Late(250))
        );
        assert_eq!(
            EmulatedFault::parse("amplifier.fault=0x3220"),
            amplifier(DeviceFault::Drive(0x3220))
        );
        assert_eq!(
            EmulatedFault::parse("probe.jump=-1mm"),
            Ok(EmulatedFault::Probe(Fault::Jump {
                every: 2,
                by_m: -1e-3
            }))
        );
        assert_eq!(
            EmulatedFault::parse("probe.corrupt=97"),
            Ok(EmulatedFault::Probe(Fault::Corrupt { every: 97 }))
        );
    }

    #[test]
    fn the_device_may_be_left_out_where_only_one_can_have_the_fault() {
        let both = ["amplifier".to_string(), "probe".to_string()];
        let cases = [
            ("stuck", "probe.stuck"),
            ("fault=0x3220", "amplifier.fault=0x3220"),
            ("late=1s", "late=1s"),
            ("none", "none"),
            ("probe.late", "probe.late"),
            ("nonsense", "nonsense"),
        ];
        for (word, expected) in cases {
            assert_eq!(whole(word, &both), expected);
        }
        assert_eq!(whole("late=1s", &both[1..]), "probe.late=1s");
    }

    #[test]
    fn what_is_no_fault_is_refused_with_what_there_is() {
        let refusal = |text| EmulatedFault::parse(text).expect_err(text).to_string();
        for text in [
            "",
            "silence",
            "amplifier",
            "amplifier.",
            "probe.nonsense",
            "probe.stuck.now",
            "nonsense=1",
        ] {
            assert!(
                refusal(text).contains("there are none, amplifier.none, amplifier.silence"),
                "{}",
                refusal(text)
            );
        }
        assert!(refusal("probe.stuck=1").contains("has no value"));
        assert!(refusal("amplifier.fault=0").contains("0x0001 to 0xFFFF"));
        assert!(refusal("amplifier.fault=0x10000").contains("0x0001"));
        assert!(refusal("probe.late=50").contains("50ms"));
        assert!(refusal("probe.late=2h").contains("an hour at most"));
        assert!(refusal("probe.corrupt=0").contains("above zero"));
        assert!(refusal("probe.jump=NaN").contains("a length"));
    }
}
