//! A probe of your own: an interferometer that sends its fringe count as a line of text. Its driver reads an emulated one on
//! a pseudo terminal, which measures the simulated stage. `docs/adding-a-probe.md` explains each step.
use std::sync::{Arc, Mutex};
use std::time::Instant;

use bench_hal::serial::{emulator::*, *};
use bench_hal::{DisplacementProbe, Tick};
use bench_rig::emulator::Stage;

const COUNT_M: f64 = 632.8e-9 / 64.0; // helium-neon laser, interpolated 64 times
/// Both sides of the line, with an unfinished line of text.
#[derive(Debug, Default)]
struct Interferometer(Vec<u8>);

impl Protocol for Interferometer {
    fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError> {
        Ok(Box::new(Interferometer::default()))
    }
    fn responder(&self) -> Result<Box<dyn Responder>, SerialError> {
        Ok(Box::new(Interferometer::default()))
    }
}

impl Decoder for Interferometer {
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
        for byte in bytes {
            match byte {
                b'\n' => out(decode(&std::mem::take(&mut self.0))),
                byte => self.0.push(*byte),
            }
        }
    }
    fn message_bytes(&self) -> u32 {
        8
    }
}

fn decode(line: &[u8]) -> Event {
    let Ok(raw) = String::from_utf8_lossy(line).parse::<i64>() else {
        return Event::Damaged(line.len() as u32 + 1);
    };
    let position_m = raw as f64 * COUNT_M;
    Event::Value(Sample { raw, position_m })
}

/// The probe's side, for rehearsals without hardware. It streams, so it has no requests.
impl Responder for Interferometer {
    fn measure(&mut self, position_m: f64) -> Vec<u8> {
        format!("{:+07.0}\n", position_m / COUNT_M).into_bytes()
    }
    fn receive(&mut self, _byte: u8) -> Vec<u8> {
        Vec::new()
    }
    fn restart(&mut self) {}
    fn out_of_range_m(&self) -> f64 {
        1.0
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let stage = Stage::new(&bench_config::load(&Default::default())?)?;
    let start = Instant::now();
    let line = Line::terminal(PortSettings::new("", 921_600))?;
    let mut port = PortSettings::new(line.path(), 921_600);
    port.lock_dir = std::env::temp_dir();
    let emulated = EmulatedProbe::new(&Interferometer::default(), 1000.0)?;
    let now_ns = move || start.elapsed().as_nanos() as u64;
    let measure = move |at_ns| 50e-6 + stage.position_m(at_ns);
    let _task = ProbeTask::start(line, Arc::new(Mutex::new(emulated)), now_ns, measure, || {})?;
    let protocol = Arc::new(Interferometer::default());
    let mut probe = SerialProbe::open(ProbeSettings::new(port, protocol))?;
    while probe.statistics().published < 100 {
        std::thread::yield_now();
        assert!(start.elapsed().as_secs() < 60, "no readings");
    }
    let reading = probe.latest(Tick::default());
    assert!((reading.position_m - 50e-6).abs() < 3e-6, "{reading:?}"); // the floor moves 0.1 um
    Ok(())
}
