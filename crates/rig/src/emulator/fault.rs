//! Faults that an emulated device can have, and their names: `amplifier.late=50ms`, `probe.stuck`, `none`.

use std::fmt;

use bench_hal::can::emulator::DeviceFault;
use bench_hal::serial::emulator::Fault;

use super::EmulatedDevice;
use bench_base::quantity::Length;

/// A fault, or the end of all faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EmulatedFault {
    /// All emulated devices work correctly again.
    None,
    /// A fault of the amplifier.
    Amplifier(AmplifierFault),
    /// A fault of the probe.
    Probe(Fault),
}

/// A fault of the amplifier, or of its bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AmplifierFault {
    /// A fault of the device.
    Device(DeviceFault),
    /// The CAN controller of the host reports bus-off, and the device neither receives nor sends.
    BusOff,
}

/// A text that names no fault.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FaultError {
    /// No such kind.
    #[error("there is no fault `{kind}`; choose one of {}", names())]
    Unknown {
        /// The text before `=`.
        kind: String,
    },
    /// A value that the kind does not accept.
    #[error("{kind}={value} is invalid; give {expected}")]
    Value {
        /// The kind.
        kind: String,
        /// The value.
        value: String,
        /// The values that the kind accepts.
        expected: &'static str,
    },
}

/// A kind of fault: its name, the fault, and what happens.
struct FaultKind {
    name: &'static str,
    form: ValueForm,
    effect: &'static str,
}

/// Whether a kind of fault has a value.
enum ValueForm {
    Fixed(EmulatedFault),
    WithValue {
        default: &'static str,
        read: fn(&str) -> Result<EmulatedFault, &'static str>,
    },
}

const fn kind(name: &'static str, form: ValueForm, effect: &'static str) -> FaultKind {
    FaultKind { name, form, effect }
}

const fn drive(fault: DeviceFault) -> EmulatedFault {
    EmulatedFault::Amplifier(AmplifierFault::Device(fault))
}

const fn fixed_drive(fault: DeviceFault) -> ValueForm {
    ValueForm::Fixed(drive(fault))
}

const fn fixed_probe(fault: Fault) -> ValueForm {
    ValueForm::Fixed(EmulatedFault::Probe(fault))
}

const fn with_value(
    default: &'static str,
    read: fn(&str) -> Result<EmulatedFault, &'static str>,
) -> ValueForm {
    ValueForm::WithValue { default, read }
}

/// All kinds of faults. A new fault is one line here.
#[rustfmt::skip]
const KINDS: [FaultKind; 23] = [
    kind("none", ValueForm::Fixed(EmulatedFault::None), "ends all faults"),
    kind("amplifier.none", fixed_drive(DeviceFault::None), "ends the fault of the amplifier"),
    kind("amplifier.silence", fixed_drive(DeviceFault::Mute), "sends nothing, but receives"),
    kind("amplifier.unplugged", fixed_drive(DeviceFault::Unplugged), "neither sends nor receives"),
    kind("amplifier.short-frames", fixed_drive(DeviceFault::ShortFrames), "sends status frames of a wrong length"),
    kind("amplifier.senseless-status", fixed_drive(DeviceFault::InvalidStatusword), "sends statuswords of undefined states"),
    kind("amplifier.fault", with_value("0x2310", drive_fault), "enters the state Fault and sends an emergency message"),
    kind("amplifier.emergency", with_value("0x4210", emergency_only), "sends an emergency message, without change of state"),
    kind("amplifier.target-ignored", fixed_drive(DeviceFault::TargetIgnored), "is enabled, but does not follow its target (bit 12)"),
    kind("amplifier.set-points-ignored", fixed_drive(DeviceFault::SetPointsIgnored), "ignores set-points, obeys NMT"),
    kind("amplifier.orders-ignored", fixed_drive(DeviceFault::CommandsIgnored), "ignores set-points and NMT"),
    kind("amplifier.switches-off", fixed_drive(DeviceFault::SwitchesOff), "switches itself off without a fault"),
    kind("amplifier.late", with_value("50ms", late_drive), "delays all messages by this time"),
    kind("amplifier.reset", fixed_drive(DeviceFault::Reset), "restarts, as after a loss of power"),
    kind("amplifier.bus-off", ValueForm::Fixed(EmulatedFault::Amplifier(AmplifierFault::BusOff)), "makes the host report bus-off; no frame passes (virtual interfaces only)"),
    kind("probe.none", fixed_probe(Fault::None), "ends the fault of the probe"),
    kind("probe.silence", fixed_probe(Fault::Silence), "sends nothing"),
    kind("probe.corrupt", with_value("1", corrupt), "corrupts every N-th byte (=N)"),
    kind("probe.stuck", fixed_probe(Fault::Stuck), "sends the same value repeatedly as a new measurement"),
    kind("probe.jump", with_value("50um", jump), "shifts every second value by this length"),
    kind("probe.out-of-range", fixed_probe(Fault::OutOfRange), "reports a target out of range"),
    kind("probe.late", with_value("50ms", late_probe), "delays all messages by this time"),
    kind("probe.reset", fixed_probe(Fault::Reset), "restarts; the measurement counter starts again at zero"),
];

/// The list of all kinds, one line each.
pub fn help() -> String {
    KINDS.iter().map(help_line).collect()
}

fn help_line(kind: &FaultKind) -> String {
    let usage = match kind.form {
        ValueForm::Fixed(_) => kind.name.to_string(),
        ValueForm::WithValue { default, .. } => format!("{}[={default}]", kind.name),
    };
    format!("  {usage:<30} {}\n", kind.effect)
}

fn names() -> String {
    KINDS.map(|kind| kind.name).join(", ")
}

/// A fault with its text, as given on the command line.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultRequest {
    /// `KIND` or `KIND=VALUE`.
    pub text: String,
    /// The fault.
    pub fault: EmulatedFault,
}

impl fmt::Display for FaultRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::str::FromStr for FaultRequest {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<FaultRequest, FaultError> {
        let (name, given) = match text.split_once('=') {
            Some((name, value)) => (name, Some(value)),
            None => (text, None),
        };
        let kind = KINDS.iter().find(|kind| kind.name == name);
        let kind = kind.ok_or_else(|| FaultError::Unknown { kind: name.into() })?;
        let fault = kind.fault(given).map_err(|expected| FaultError::Value {
            kind: name.into(),
            value: given.unwrap_or_default().into(),
            expected,
        })?;
        let text = text.into();
        Ok(FaultRequest { text, fault })
    }
}

impl FaultRequest {
    /// Reads a fault whose device may be omitted, if only one of the emulated `devices` can have it.
    pub fn parse_for(text: &str, devices: &[EmulatedDevice]) -> Result<FaultRequest, FaultError> {
        qualified(text, devices).parse()
    }

    /// The request that ends this fault.
    pub fn end(&self) -> FaultRequest {
        FaultRequest {
            text: format!("end of {}", self.text),
            fault: self.fault.end(),
        }
    }
}

/// `text` with the name of its device in front, if exactly one of `devices` can have this fault.
fn qualified(text: &str, devices: &[EmulatedDevice]) -> String {
    let name = text.split('=').next().unwrap_or(text);
    let is_kind_of = |device: &&EmulatedDevice| {
        let full = format!("{device}.{name}");
        name != "none" && KINDS.iter().any(|kind| kind.name == full)
    };
    match devices.iter().filter(is_kind_of).collect::<Vec<_>>()[..] {
        [device] => format!("{device}.{text}"),
        _ => text.into(),
    }
}

impl FaultKind {
    fn fault(&self, value: Option<&str>) -> Result<EmulatedFault, &'static str> {
        match (&self.form, value) {
            (ValueForm::Fixed(fault), None) => Ok(*fault),
            (ValueForm::Fixed(_), Some(_)) => Err("left out: this fault has no value"),
            (ValueForm::WithValue { default, read }, value) => read(value.unwrap_or(default)),
        }
    }
}

impl AmplifierFault {
    /// The amplifier works correctly again.
    pub(super) const NONE: AmplifierFault = AmplifierFault::Device(DeviceFault::None);
}

impl EmulatedFault {
    /// The device under which the log shows this fault.
    pub(super) fn device(self) -> EmulatedDevice {
        match self {
            EmulatedFault::Probe(_) => EmulatedDevice::Probe,
            _ => EmulatedDevice::Amplifier,
        }
    }

    /// The fault that ends this one.
    pub fn end(self) -> EmulatedFault {
        match self {
            EmulatedFault::None => EmulatedFault::None,
            EmulatedFault::Amplifier(_) => drive(DeviceFault::None),
            EmulatedFault::Probe(_) => EmulatedFault::Probe(Fault::None),
        }
    }
}

fn drive_fault(value: &str) -> Result<EmulatedFault, &'static str> {
    Ok(drive(DeviceFault::Drive(emergency_code(value)?)))
}

fn emergency_only(value: &str) -> Result<EmulatedFault, &'static str> {
    Ok(drive(DeviceFault::EmergencyOnly(emergency_code(value)?)))
}

fn late_drive(value: &str) -> Result<EmulatedFault, &'static str> {
    let milliseconds = nanoseconds(value)? / 1_000_000;
    Ok(drive(DeviceFault::Late(milliseconds)))
}

fn late_probe(value: &str) -> Result<EmulatedFault, &'static str> {
    let by_ns = nanoseconds(value)?;
    Ok(EmulatedFault::Probe(Fault::Late { by_ns }))
}

fn corrupt(value: &str) -> Result<EmulatedFault, &'static str> {
    match value.parse() {
        Ok(every) if every > 0 => Ok(EmulatedFault::Probe(Fault::Corrupt { every })),
        _ => Err("a whole number of bytes, above zero"),
    }
}

fn jump(value: &str) -> Result<EmulatedFault, &'static str> {
    let length: Result<Length, _> = value.parse();
    let by_m = length
        .map_err(|_| "a length (50um, 0.5mm, or metres)")?
        .si();
    Ok(EmulatedFault::Probe(Fault::Jump { every: 2, by_m }))
}

/// An emergency code: hexadecimal with 0x, or decimal.
fn emergency_code(text: &str) -> Result<u16, &'static str> {
    let hexadecimal = text.strip_prefix("0x").or(text.strip_prefix("0X"));
    let code = match hexadecimal {
        Some(digits) => u16::from_str_radix(digits, 16),
        None => text.parse(),
    };
    code.ok()
        .filter(|code| *code > 0)
        .ok_or("an emergency code from 0x0001 to 0xFFFF")
}

/// A time of at most one hour, with its unit.
fn nanoseconds(text: &str) -> Result<u64, &'static str> {
    match humantime::parse_duration(text) {
        Ok(time) if time.as_secs() <= 3600 => Ok(time.as_nanos() as u64),
        _ => Err("a time with its unit (50ms, 200us, 1s), an hour at most"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<EmulatedFault, FaultError> {
        text.parse().map(|request: FaultRequest| request.fault)
    }

    #[test]
    fn every_kind_is_a_different_fault_and_is_listed_in_the_help() {
        let faults: Vec<EmulatedFault> = KINDS.map(|k| parse(k.name).expect(k.name)).to_vec();
        for (index, fault) in faults.iter().enumerate() {
            assert!(!faults[..index].contains(fault), "{}", KINDS[index].name);
            assert!(help().contains(KINDS[index].name));
        }
    }

    #[test]
    fn reads_values_with_their_units() {
        assert_eq!(
            parse("amplifier.late=250ms"),
            Ok(drive(DeviceFault::Late(250)))
        );
        assert_eq!(
            parse("amplifier.fault=0x3220"),
            Ok(drive(DeviceFault::Drive(0x3220)))
        );
        let jump = Fault::Jump {
            every: 2,
            by_m: -1e-3,
        };
        assert_eq!(parse("probe.jump=-1mm"), Ok(EmulatedFault::Probe(jump)));
        let corrupt = Fault::Corrupt { every: 97 };
        assert_eq!(parse("probe.corrupt=97"), Ok(EmulatedFault::Probe(corrupt)));
    }

    #[test]
    fn completes_the_device_if_only_one_can_have_the_fault() {
        let both = [EmulatedDevice::Amplifier, EmulatedDevice::Probe];
        let cases = [
            ("stuck", "probe.stuck"),
            ("fault=0x3220", "amplifier.fault=0x3220"),
            ("late=1s", "late=1s"),
            ("none", "none"),
            ("probe.late", "probe.late"),
            ("nonsense", "nonsense"),
        ];
        for (text, expected) in cases {
            assert_eq!(qualified(text, &both), expected);
        }
        assert_eq!(qualified("late=1s", &both[1..]), "probe.late=1s");
    }

    #[test]
    fn rejects_unknown_faults_and_values_and_lists_what_is_accepted() {
        let refusal = |text| parse(text).expect_err(text).to_string();
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
                refusal(text).contains("choose one of none, amplifier.none, amplifier.silence"),
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
