//! The monitor at its time limits, to the nanosecond, without bus and clock.
//!
//! Numbers are those of CiA 301 and CiA 402: identifiers 0x705 (heartbeat), 0x085 (emergency) and 0x185 (status) of node 5,
//! statuswords 0x1237 (operation enabled, target followed, remote), 0x0240 (switch on disabled) and 0x0208 (fault).

use super::super::super::bus::BusEvent;
use super::super::super::frame::{CanFrame, Id};
use super::super::super::sync;
use super::*;

const ENABLED: u16 = 0x1237;
const OFF: u16 = 0x0240;
const FAULT: u16 = 0x0208;
/// The default time limits.
const HEARTBEAT_NS: u64 = 70 * MS;
const STATUS_NS: u64 = 20 * MS;
const COMMAND_NS: u64 = 20 * MS;
const OFF_NS: u64 = 70 * MS;
/// Nanoseconds of a millisecond.
const MS: u64 = 1_000_000;

/// A monitor and what it shares with the loop.
struct Watch {
    shared: Arc<Shared>,
    monitor: Monitor,
}

impl Watch {
    /// A monitor at time 0, of a drive that is off.
    fn new(exchange: Exchange) -> Watch {
        let settings = DriveSettings {
            exchange,
            ..DriveSettings::default()
        };
        let shared = Arc::new(Shared::default());
        let monitor = Monitor::new(&settings, Arc::clone(&shared), 0);
        Watch { shared, monitor }
    }

    /// A monitor whose caller has enabled the drive at time 0.
    fn enabled(exchange: Exchange) -> Watch {
        let mut watch = Watch::new(exchange);
        watch.shared.set_intent(Intent::On);
        watch.poll(0);
        watch
    }

    /// The frames that are sent at `now_ns`.
    fn poll(&mut self, now_ns: u64) -> Vec<CanFrame> {
        let mut sent = Vec::new();
        self.monitor.poll(now_ns, &mut |frame| sent.push(frame));
        sent
    }

    /// The frames without the heartbeats of this program.
    fn poll_commands(&mut self, now_ns: u64) -> Vec<CanFrame> {
        let mut sent = self.poll(now_ns);
        sent.retain(|frame| frame.id() != Id::standard(0x77F));
        sent
    }

    fn receive(&mut self, id: u16, bytes: &[u8], now_ns: u64) {
        let frame = CanFrame::from_slice(Id::standard(id), bytes).unwrap();
        self.monitor.handle(&BusEvent::Frame(frame), now_ns);
    }

    fn heartbeat(&mut self, now_ns: u64) {
        self.receive(0x705, &[0x05], now_ns);
    }

    fn status(&mut self, statusword: u16, now_ns: u64) {
        let [low, high] = statusword.to_le_bytes();
        self.receive(0x185, &[low, high, 0, 0], now_ns);
    }

    fn emergency(&mut self, code: u16, now_ns: u64) {
        let [low, high] = code.to_le_bytes();
        self.receive(0x085, &[low, high, 0, 0, 0, 0, 0, 0], now_ns);
    }
}

/// Controlword `disable voltage` and the target 0.
fn disable_frame() -> CanFrame {
    CanFrame::new(Id::standard(0x205), [0, 0, 0, 0])
}

#[test]
fn heartbeat_is_lost_one_nanosecond_after_its_time_limit() {
    let mut watch = Watch::new(ASYNCHRONOUS);
    watch.heartbeat(3);
    watch.status(OFF, 3);
    watch.poll(3 + HEARTBEAT_NS);
    assert_eq!(watch.shared.fault(), 0);
    assert_eq!(watch.shared.statusword(), Some(OFF));
    watch.poll(4 + HEARTBEAT_NS);
    assert_eq!(watch.shared.fault(), faults::HEARTBEAT_LOST);
    assert_eq!(watch.shared.statusword(), None, "an old status is unknown");
    assert_eq!((watch.shared.actual(), watch.shared.nmt()), (None, None));
}

#[test]
fn status_is_lost_one_nanosecond_after_its_time_limit() {
    let mut watch = Watch::enabled(ASYNCHRONOUS);
    watch.status(ENABLED, 5);
    watch.poll(5 + STATUS_NS);
    assert_eq!(watch.shared.fault(), 0);
    watch.poll(6 + STATUS_NS);
    assert_eq!(watch.shared.fault(), faults::STATUS_LOST);
}

#[test]
fn missing_status_counts_from_the_enabling_or_from_the_first_command() {
    // With a timer the drive sends its status by itself; with SYNC it answers the commands.
    for (exchange, first_command_ns) in [(ASYNCHRONOUS, None), (SYNCHRONOUS, Some(9 * MS))] {
        let mut watch = Watch::enabled(exchange);
        watch.poll(9 * MS - 1);
        watch.shared.note_command();
        watch.poll(9 * MS);
        let since_ns = first_command_ns.unwrap_or(0);
        // Commands go on, so that only the status is missing.
        watch.shared.note_command();
        watch.poll(since_ns + STATUS_NS);
        assert_eq!(watch.shared.fault(), 0, "{exchange:?}");
        watch.poll(since_ns + STATUS_NS + 1);
        assert_eq!(watch.shared.fault(), faults::STATUS_LOST, "{exchange:?}");
    }
}

#[test]
fn commands_have_stopped_one_nanosecond_after_their_time_limit() {
    let mut watch = Watch::enabled(ASYNCHRONOUS);
    watch.shared.note_command();
    watch.poll(MS);
    watch.status(ENABLED, 15 * MS);
    watch.poll(MS + COMMAND_NS);
    assert_eq!(watch.shared.fault(), 0);
    watch.poll(MS + COMMAND_NS + 1);
    assert_eq!(watch.shared.fault(), faults::COMMANDS_STOPPED);
}

#[test]
fn disable_is_repeated_every_ten_milliseconds_until_a_newer_status_confirms_it() {
    let mut watch = Watch::enabled(ASYNCHRONOUS);
    watch.status(OFF, MS); // older than the disable: no confirmation
    watch.shared.clear_fault();
    watch.shared.set_intent(Intent::Off);
    let repeats = [
        (2 * MS, true),
        (5 * MS, false),
        (12 * MS - 1, false),
        (12 * MS, true),
        (25 * MS, true),
        (35 * MS - 1, false),
        (35 * MS, true),
    ];
    for (now_ns, is_sent) in repeats {
        let expected = if is_sent {
            vec![disable_frame()]
        } else {
            Vec::new()
        };
        assert_eq!(watch.poll_commands(now_ns), expected, "at {now_ns} ns");
    }
    watch.status(OFF, 36 * MS);
    for now_ns in [45 * MS, 60 * MS, 69 * MS] {
        assert_eq!(watch.poll_commands(now_ns), [], "confirmed");
    }
}

#[test]
fn nmt_stop_follows_one_nanosecond_after_the_time_limit_of_a_disable() {
    for (late_ns, is_stopped) in [(0, false), (1, true)] {
        let mut watch = Watch::enabled(ASYNCHRONOUS);
        watch.shared.set_intent(Intent::Off);
        watch.poll(MS);
        watch.heartbeat(50 * MS);
        let stop = nmt::Command::Stop.frame(5);
        let sent = watch.poll(MS + OFF_NS + late_ns);
        assert_eq!(sent.contains(&stop), is_stopped);
        let own_heartbeat = sent.iter().any(|frame| frame.id() == Id::standard(0x77F));
        assert_eq!(own_heartbeat, !is_stopped, "its end stops the drive");
        let fault = if is_stopped { faults::STILL_ENABLED } else { 0 };
        assert_eq!(watch.shared.fault(), fault);
    }
}

#[test]
fn a_use_between_two_looks_of_the_monitor_is_switched_off_too() {
    let mut watch = Watch::new(ASYNCHRONOUS);
    assert_eq!(watch.poll_commands(0), [], "never used");
    watch.shared.set_intent(Intent::On);
    watch.shared.set_intent(Intent::Off);
    assert_eq!(watch.poll_commands(MS), [disable_frame()]);
}

#[test]
fn sync_is_sent_every_twenty_milliseconds_while_a_synchronous_drive_is_idle() {
    let mut watch = Watch::new(SYNCHRONOUS);
    let idle = [
        (MS, true),
        (11 * MS, false),
        (21 * MS - 1, false),
        (21 * MS, true),
        (45 * MS, true),
        (64 * MS, false),
    ];
    for (now_ns, is_sent) in idle {
        let expected = if is_sent {
            vec![sync::FRAME]
        } else {
            Vec::new()
        };
        assert_eq!(watch.poll_commands(now_ns), expected, "at {now_ns} ns");
    }
    watch.heartbeat(64 * MS);
    watch.shared.set_intent(Intent::On);
    assert_eq!(
        watch.poll_commands(66 * MS),
        [],
        "the loop sends SYNC itself"
    );
    watch.shared.set_intent(Intent::Off);
    let disable = [disable_frame(), sync::FRAME];
    assert_eq!(watch.poll_commands(90 * MS), disable);
    assert_eq!(watch.poll_commands(95 * MS), [], "not confirmed: not idle");
    watch.status(OFF, 96 * MS);
    assert_eq!(watch.poll_commands(97 * MS), [sync::FRAME]);
    let mut asynchronous = Watch::new(ASYNCHRONOUS);
    assert_eq!(asynchronous.poll_commands(MS), []);
}

#[test]
fn emergency_of_a_drive_that_is_off_is_no_fault_by_itself() {
    let mut watch = Watch::new(ASYNCHRONOUS);
    watch.emergency(0x2310, MS);
    assert_eq!(watch.shared.fault(), 0);
    watch.status(FAULT, 2 * MS);
    assert_eq!(watch.shared.fault(), faults::EMERGENCY + 0x2310);
}

#[test]
fn emergency_explains_a_fault_that_the_status_reported_first() {
    let mut watch = Watch::new(ASYNCHRONOUS);
    watch.status(FAULT, MS);
    assert_eq!(watch.shared.fault(), faults::DRIVE_FAULT);
    watch.emergency(0x3220, 2 * MS);
    assert_eq!(watch.shared.fault(), faults::EMERGENCY + 0x3220);
}

#[test]
fn emergency_without_a_code_is_no_fault() {
    let mut watch = Watch::enabled(ASYNCHRONOUS);
    watch.emergency(0, MS);
    assert_eq!(watch.shared.fault(), 0);
}

#[test]
fn status_is_not_judged_while_a_fault_is_reset() {
    let mut watch = Watch::new(ASYNCHRONOUS);
    watch.shared.request_reset();
    watch.status(FAULT, MS);
    assert_eq!(watch.shared.fault(), 0);
    watch.shared.end_reset();
    assert_eq!(watch.shared.intent(), Intent::Off);
    watch.status(FAULT, 2 * MS);
    assert_eq!(watch.shared.fault(), faults::DRIVE_FAULT);
}

#[test]
fn end_of_a_reset_does_not_replace_a_newer_intent() {
    let shared = Shared::default();
    shared.request_reset();
    shared.set_intent(Intent::Enabling);
    shared.end_reset();
    assert_eq!(shared.intent(), Intent::Enabling);
}
