//! Damaged files: reading returns recorded data or an error, for any bytes.
use std::path::Path;
use std::sync::LazyLock;

use bench_recording::{Header, MissingTicks, Recorder, Recording, RecordingError, recover};
use bench_rt::record::{Event, EventKind, LoopMessage, TickRecord};
use proptest::prelude::*;

use crate::recording::common::{CONFIG, bits, events_of, header, run, ticks_of, write};

/// 20 ms per tick: few ticks make many chunks, so that a large part of the file is structure.
fn slow_run(ticks: u64) -> Vec<LoopMessage> {
    let slow = |p: LoopMessage| match p {
        LoopMessage::Tick(t) => LoopMessage::Tick(TickRecord {
            scheduled_ns: t.tick * 20_000_000,
            ..t
        }),
        event @ LoopMessage::Event(_) => event,
    };
    run(ticks).into_iter().map(slow).collect()
}

struct Original {
    ticks: Vec<TickRecord>,
    events: Vec<Event>,
    bytes: Vec<u8>,
}

static ORIGINAL: LazyLock<Original> = LazyLock::new(|| {
    let published = slow_run(30);
    let file = tempfile::tempdir().expect("temporary directory");
    let path = file.path().join("original.mcap");
    write(&path, &published);
    let bytes = std::fs::read(&path).expect("just written");
    Original {
        ticks: ticks_of(&published),
        events: events_of(&published),
        bytes,
    }
});

/// Opens and salvages `bytes`. The returned data must be recorded data, and all of it if the file is not reported as truncated.
fn check(bytes: &[u8], path: &Path) -> Result<(), TestCaseError> {
    std::fs::write(path, bytes).expect("temporary file");
    let opened = Recording::open(path);
    if let Ok(recording) = &opened {
        check_contents(recording, bytes.len())?;
        let all = recording.tick_count() == ORIGINAL.ticks.len() as u64
            && *recording.events() == ORIGINAL.events;
        prop_assert!(
            all || recording.truncated(),
            "incomplete but not reported as truncated"
        );
    }
    match Recording::salvage(path) {
        Ok(recording) => check_salvaged(&recording, bytes.len())?,
        Err(error) => prop_assert!(opened.is_err(), "opened, but not salvaged: {error}"),
    }
    Ok(())
}

fn check_contents(recording: &Recording, of_bytes: usize) -> Result<(), TestCaseError> {
    let ticks = ticks_in(recording);
    prop_assert_eq!(ticks.len() as u64, recording.tick_count());
    prop_assert!(
        ticks
            .iter()
            .map(bits)
            .eq(ORIGINAL.ticks[..ticks.len()].iter().map(bits)),
        "altered ticks"
    );
    prop_assert!(
        ORIGINAL.events.starts_with(recording.events()),
        "altered events"
    );
    prop_assert!(
        recording.config_toml().is_none_or(|c| c == CONFIG),
        "altered configuration"
    );
    match recording.cut() {
        Some(cut) => {
            prop_assert!(cut.at_byte <= of_bytes as u64 && cut.of_bytes == of_bytes as u64)
        }
        None => prop_assert_eq!(&recording.metadata()["host"], "test"),
    }
    Ok(())
}

fn ticks_in(recording: &Recording) -> Vec<TickRecord> {
    let ticks = recording.ticks().and_then(Iterator::collect);
    ticks.expect("has just been read")
}

/// Every tick and event is one of the original, in the original order, and nothing is missing unless a damage or a cut is
/// reported.
fn check_salvaged(recording: &Recording, of_bytes: usize) -> Result<(), TestCaseError> {
    let ticks = ticks_in(recording);
    prop_assert_eq!(ticks.len() as u64, recording.tick_count());
    prop_assert!(ticks.is_sorted_by(|a, b| a.tick < b.tick), "order of ticks");
    for tick in &ticks {
        let original = ORIGINAL.ticks.get(tick.tick as usize);
        prop_assert_eq!(original.map(bits), Some(bits(tick)), "altered tick");
    }
    let is_original = |event: &&Event| !matches!(event.kind, EventKind::Lost { .. });
    let events: Vec<&Event> = recording.events().iter().filter(is_original).collect();
    let mut originals = ORIGINAL.events.iter();
    prop_assert!(
        events.iter().all(|event| originals.any(|o| o == *event)),
        "altered events"
    );
    prop_assert!(
        recording.config_toml().is_none_or(|c| c == CONFIG),
        "altered configuration"
    );
    let is_reported = recording.cut().is_some() || !recording.damage().is_empty();
    let is_all = ticks.len() == ORIGINAL.ticks.len()
        && events.len() == ORIGINAL.events.len()
        && recording.config_toml().is_some()
        && recording.attachment("result.json").is_some()
        && recording
            .metadata()
            .get("host")
            .is_some_and(|host| host == "test");
    prop_assert!(is_all || is_reported, "a loss that is not reported");
    for damage in recording.damage() {
        prop_assert!(damage.from_byte < damage.to_byte && damage.to_byte <= of_bytes as u64);
    }
    Ok(())
}

#[test]
fn file_truncated_at_any_byte_gives_its_readable_part_or_an_error() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("cut.mcap");
    for length in 0..ORIGINAL.bytes.len() {
        check(&ORIGINAL.bytes[..length], &path)
            .unwrap_or_else(|e| panic!("truncated at {length}: {e}"));
        let opened = Recording::open(&path);
        assert!(
            opened.is_err_and(|e| !e.to_string().is_empty()) || opened_truncated(&path),
            "truncated at {length}"
        );
    }
}

fn opened_truncated(path: &Path) -> bool {
    Recording::open(path).is_ok_and(|r| r.truncated())
}

#[test]
fn single_altered_byte_is_never_returned_as_data() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("altered.mcap");
    let mut bytes = ORIGINAL.bytes.clone();
    for at in 0..bytes.len() {
        let flip = 1 << (at % 8);
        bytes[at] ^= flip;
        check(&bytes, &path).unwrap_or_else(|e| panic!("byte {at} ^ {flip:#x}: {e}"));
        bytes[at] ^= flip;
    }
}

/// The ticks of the chunk that contains a byte.
fn ticks_at(byte: usize) -> std::ops::Range<u64> {
    // 100 ms a tick are five ticks a chunk; the first chunk has the definitions, and the last one the end of the run.
    let chunks = chunks(&ORIGINAL.bytes);
    match chunks
        .iter()
        .position(|(at, length)| (*at..at + length).contains(&byte))
    {
        None | Some(0) => 0..0,
        Some(chunk) => 5 * (chunk as u64 - 1)..5 * chunk as u64,
    }
}

#[test]
fn recovery_after_one_altered_bit_loses_the_ticks_of_one_chunk_at_most_and_says_so() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let (path, to) = (dir.path().join("altered.mcap"), dir.path().join("to.mcap"));
    let mut bytes = ORIGINAL.bytes.clone();
    for at in 0..bytes.len() {
        let flip = 1 << (at % 8);
        bytes[at] ^= flip;
        std::fs::write(&path, &bytes).expect("temporary file");
        bytes[at] ^= flip;
        let recovery = recover(&path, &to).unwrap_or_else(|e| panic!("byte {at}: {e}"));
        assert!(
            recovery.others.is_empty() && recovery.unused.is_empty(),
            "byte {at}: one recording, and every byte belongs to it"
        );
        let recovered = recovery.first;
        let new = Recording::open(&to).unwrap_or_else(|e| panic!("byte {at}: {e}"));
        let found: Vec<u64> = ticks_in(&new).iter().map(|tick| tick.tick).collect();
        let may_be_lost = ticks_at(at);
        let absent: Vec<u64> = (0..30).filter(|tick| !found.contains(tick)).collect();
        assert!(
            absent.iter().all(|tick| may_be_lost.contains(tick)),
            "byte {at}: {absent:?} are missing"
        );
        let reported = recovered.missing_ticks.iter();
        let reported: Vec<u64> = reported.flat_map(|m| m.first_tick..=m.last_tick).collect();
        assert_eq!(reported, absent, "byte {at}");
        assert_eq!(new.lost_records() > 0, recovered.totals.lost_records > 0);
        if recovered.is_complete() {
            check_contents(&new, 0).unwrap_or_else(|e| panic!("byte {at}: {e}"));
            assert!(absent.is_empty() && new.events() == ORIGINAL.events && !new.truncated());
        }
        std::fs::remove_file(&to).expect("just written");
    }
}

#[test]
fn recovery_finds_the_channels_without_their_definitions() {
    // The file is cut, so it has no summary, and its first chunk, which defines the channels, is damaged.
    let chunks = chunks(&ORIGINAL.bytes);
    let mut bytes = ORIGINAL.bytes[..chunks[4].0].to_vec();
    bytes[chunks[0].0 + chunks[0].1 - 8] ^= 1;
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("altered.mcap");
    std::fs::write(&path, &bytes).expect("temporary file");
    let recording = Recording::salvage(&path).expect("three chunks are intact");
    assert_eq!(recording.tick_count(), 15);
    check_salvaged(&recording, bytes.len()).expect("original ticks");
}

#[test]
fn recovery_resumes_after_bytes_that_are_missing_or_overwritten() {
    let chunks = chunks(&ORIGINAL.bytes);
    let (second, third) = (chunks[2].0, chunks[3].0);
    let removed = [&ORIGINAL.bytes[..second + 20], &ORIGINAL.bytes[third - 7..]].concat();
    let mut zeroed = ORIGINAL.bytes.clone();
    zeroed[second..third].fill(0);
    let noise = [
        &ORIGINAL.bytes[..second],
        &[6; 1000],
        &ORIGINAL.bytes[third..],
    ]
    .concat();
    for bytes in [removed, zeroed, noise] {
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("altered.mcap");
        std::fs::write(&path, &bytes).expect("temporary file");
        let recording = Recording::salvage(&path).expect("the other chunks are intact");
        let missing = MissingTicks {
            first_tick: 5,
            last_tick: 9,
            ticks: 5,
        };
        assert_eq!(recording.missing_ticks(), [missing]);
        assert_eq!(recording.tick_count(), 25);
        assert_eq!(recording.lost_records(), 5);
        check_salvaged(&recording, bytes.len()).expect("original ticks");
    }
}

proptest! {
    #[test]
    fn truncated_and_altered_files_never_return_altered_data(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1u8..), 0..6),
        zeroed in prop::option::of((any::<prop::sample::Index>(), 0usize..40)),
        length in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = ORIGINAL.bytes.clone();
        flips.iter().for_each(|(at, flip)| bytes[at.index(ORIGINAL.bytes.len())] ^= flip);
        if let Some((from, count)) = zeroed {
            bytes.iter_mut().skip(from.index(ORIGINAL.bytes.len())).take(count).for_each(|b| *b = 0);
        }
        bytes.truncate(length.map_or(usize::MAX, |l| l.index(ORIGINAL.bytes.len())));
        let dir = tempfile::tempdir().expect("temporary directory");
        check(&bytes, &dir.path().join("damaged.mcap"))?;
    }

    #[test]
    fn arbitrary_records_cause_no_panic(
        records in prop::collection::vec((0u8..18, prop::collection::vec(prop_oneof![Just(0u8), any::<u8>()], 0..80)), 0..6),
    ) {
        let mut bytes = mcap::MAGIC.to_vec();
        for (opcode, body) in records {
            bytes.extend(record(opcode, &body));
        }
        let dir = tempfile::tempdir().expect("temporary directory");
        let path = dir.path().join("any.mcap");
        std::fs::write(&path, &bytes).expect("temporary file");
        prop_assert!(Recording::open(&path).is_err() && Recording::salvage(&path).is_err(), "the file has no tick");
    }
}

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// (offset, length including the record header, opcode) of each record of the data section.
fn records(bytes: &[u8]) -> Vec<(usize, usize, u8)> {
    let mut found = Vec::new();
    let mut at = mcap::MAGIC.len();
    while bytes[at] != mcap::records::op::DATA_END {
        let length =
            u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes")) as usize + 9;
        found.push((at, length, bytes[at]));
        at += length;
    }
    found
}

fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    records(bytes)
        .iter()
        .filter(|r| r.2 == mcap::records::op::CHUNK)
        .map(|r| (r.0, r.1))
        .collect()
}

fn open(bytes: &[u8]) -> Result<Recording, RecordingError> {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("crafted.mcap");
    std::fs::write(&path, bytes).expect("temporary file");
    Recording::open(&path)
}

#[test]
fn rejects_attachment_without_crc() {
    // Two times, an empty name, an empty media type, an empty content and no CRC.
    let bytes = [
        mcap::MAGIC,
        &record(mcap::records::op::ATTACHMENT, &[0; 8 + 8 + 4 + 4 + 8]),
    ]
    .concat();
    let refused = open(&bytes).expect_err("refused");
    assert!(
        refused
            .to_string()
            .contains("an attachment shorter than its own header"),
        "{refused}"
    );
}

#[test]
fn detects_a_missing_chunk_in_a_truncated_file() {
    let chunks = chunks(&ORIGINAL.bytes);
    let (at, length) = chunks[2]; // the first holds the schemas, the second the first tenth of a second
    let end = chunks[4].0;
    let without = [&ORIGINAL.bytes[..at], &ORIGINAL.bytes[at + length..end]].concat();
    let refused = open(&without).expect_err("refused");
    assert!(
        refused.to_string().contains("of /loop is missing"),
        "{refused}"
    );
    assert!(
        open(&ORIGINAL.bytes[..end]).is_ok_and(|r| r.truncated()),
        "the same file with that chunk is readable"
    );
}

#[test]
fn rejects_chunk_without_crc() {
    let chunks = chunks(&ORIGINAL.bytes);
    let mut bytes = ORIGINAL.bytes[..chunks[4].0].to_vec(); // truncated, so there is no CRC of the whole file
    let crc = chunks[2].0 + 9 + 8 + 8 + 8; // after opcode, length, two times and a size
    bytes[crc..crc + 4].fill(0);
    let refused = open(&bytes).expect_err("refused");
    assert!(
        refused.to_string().contains("a chunk without a CRC"),
        "{refused}"
    );
}

#[test]
fn unusable_files_are_reported_by_kind_with_a_remedy() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let assert_error = |name: &str, words: &str| {
        let error = Recording::open(&dir.path().join(name))
            .expect_err(name)
            .to_string();
        assert!(error.contains(words) && error.contains(name), "{error}");
    };
    let write_file = |name: &str, bytes: &[u8]| {
        std::fs::write(dir.path().join(name), bytes).expect("temporary file")
    };

    assert_error("absent.mcap", "no such file; check the name");
    write_file("table.csv", b"time,position\n0.0,1.0\n");
    assert_error(
        "table.csv",
        "not an MCAP file; give a recording made by bench",
    );
    write_file("nothing.mcap", b"");
    assert_error("nothing.mcap", "not an MCAP file");
    write_file("external.mcap", &external());
    assert_error(
        "external.mcap",
        "without bench's channel /loop (it has /imu of none)",
    );
    write_file("head.mcap", &ORIGINAL.bytes[..chunks(&ORIGINAL.bytes)[1].0]);
    assert_error("head.mcap", "has no ticks (it was cut off");
    write_file("barely.mcap", mcap::MAGIC);
    assert_error("barely.mcap", "has no ticks (it was cut off");
    let path = dir.path().join("idle.mcap");
    Recorder::create(&path, &Header::default())
        .expect("fresh")
        .finish(&[])
        .expect("good disk");
    assert_error("idle.mcap", "has no ticks (it is complete)");
    std::fs::create_dir(dir.path().join("folder")).expect("temporary");
    assert_error("folder", "cannot read the recording");
    assert!(Recorder::create(&dir.path().join("no/such/place.mcap"), &header()).is_err());
}

fn external() -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut out).expect("memory");
    let schema = writer
        .add_schema("none", "jsonschema", b"{}")
        .expect("memory");
    let channel = writer
        .add_channel(schema, "/imu", "json", &Default::default())
        .expect("memory");
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    writer
        .write_to_known_channel(&header, b"{}")
        .expect("memory");
    writer.finish().expect("memory");
    drop(writer);
    out.into_inner()
}
