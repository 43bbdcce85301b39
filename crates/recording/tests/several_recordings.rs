//! Files that hold several recordings, complete, cut off or damaged: each of them is recovered, and never mixed with another one.

use std::path::{Path, PathBuf};

use bench_recording::{Header, Recorder, Recording, RecordingError, Recovered, Recovery, recover};
use bench_rt::record::{LoopMessage, TickRecord};
use mcap::records::op;

/// 20 ms a tick: a chunk is closed every 100 ms, so it holds five ticks.
const PERIOD_NS: u64 = 20_000_000;
const TICKS_PER_CHUNK: u64 = 5;

/// A recording whose ticks all have the position `run` in metres, and whose results are `attachment`.
fn recording_with(run: u32, ticks: u64, attachment: &[u8]) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let header = Header {
        config_toml: format!("run = {run}\n"),
        period_s: PERIOD_NS as f64 * 1e-9,
        ..Header::default()
    };
    let mut recorder = Recorder::create(&path, &header).expect("a fresh file");
    for tick in 0..ticks {
        let record = TickRecord {
            tick,
            scheduled_ns: tick * PERIOD_NS,
            position_m: f64::from(run),
            ..TickRecord::default()
        };
        recorder.record(&LoopMessage::Tick(record)).expect("room");
    }
    let results = [("result", "application/octet-stream", attachment)];
    recorder.finish(&results).expect("room");
    std::fs::read(&path).expect("just written")
}

fn recording(run: u32, ticks: u64) -> Vec<u8> {
    recording_with(run, ticks, b"{}")
}

/// A folder with a file of these bytes.
struct Joined {
    folder: tempfile::TempDir,
    bytes: u64,
}

impl Joined {
    fn of(parts: &[&[u8]]) -> Joined {
        let folder = tempfile::tempdir().expect("a folder");
        let bytes = parts.concat();
        std::fs::write(folder.path().join("joined.mcap"), &bytes).expect("room");
        Joined {
            folder,
            bytes: bytes.len() as u64,
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn try_recover(&self) -> Result<Recovery, RecordingError> {
        recover(&self.path("joined.mcap"), &self.path("to.mcap"))
    }

    fn recover(&self) -> Recovery {
        let recovery = self.try_recover().expect("a recording");
        assert_eq!(recovery.first.totals.path, self.path("to.mcap"));
        for (other, number) in recovery.others.iter().zip(2..) {
            let name = format!("to-{number}.mcap");
            assert_eq!(other.totals.path, self.path(&name));
        }
        for recovered in recovery.recordings() {
            assert_eq!(run_and_ticks(recovered).1, recovered.totals.ticks);
        }
        for unused in &recovery.unused {
            assert!(unused.from_byte < unused.to_byte && unused.to_byte <= self.bytes);
        }
        recovery
    }
}

/// The run of which the recovered file holds ticks, and their number. All of them are of the same run.
fn run_and_ticks(recovered: &Recovered) -> (u32, u64) {
    let new = Recording::open(&recovered.totals.path).expect("complete");
    assert!(!new.truncated());
    let ticks: Vec<TickRecord> = new.ticks().and_then(Iterator::collect).expect("complete");
    let run = ticks[0].position_m as u32;
    assert!(ticks.iter().all(|tick| tick.position_m == f64::from(run)));
    assert!(ticks.is_sorted_by(|a, b| a.tick < b.tick));
    (run, ticks.len() as u64)
}

/// (run, ticks, start) of each recovered recording.
fn found(recovery: &Recovery) -> Vec<(u32, u64, u64)> {
    let of = |recovered| {
        let (run, ticks) = run_and_ticks(recovered);
        (run, ticks, recovered.from_byte)
    };
    recovery.recordings().map(of).collect()
}

/// (start, end, opcode) of each record of the data section.
fn records(bytes: &[u8]) -> Vec<(usize, usize, u8)> {
    let mut found = Vec::new();
    let mut at = mcap::MAGIC.len();
    while bytes[at] != op::DATA_END {
        let length = bytes[at + 1..at + 9].try_into().expect("eight bytes");
        let end = at + 9 + u64::from_le_bytes(length) as usize;
        found.push((at, end, bytes[at]));
        at = end;
    }
    found
}

/// The ticks in the complete chunks of the first `length` bytes. The first chunk has the definitions; the last one also has the
/// summary of the last second, but no tick if it is not needed for them.
fn ticks_before(bytes: &[u8], length: usize, ticks: u64) -> u64 {
    let is_complete = |record: &&(usize, usize, u8)| record.2 == op::CHUNK && record.1 <= length;
    let chunks = records(bytes).iter().filter(is_complete).count() as u64;
    (chunks.saturating_sub(1) * TICKS_PER_CHUNK).min(ticks)
}

/// splitmix64, so that every run of the tests has the same bytes.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }

    fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.next() as u8).collect()
    }
}

#[test]
fn two_complete_recordings_are_recovered_into_two_files() {
    let (a, b) = (recording(1, 23), recording(2, 41));
    let joined = Joined::of(&[&a, &b]);
    let recovery = joined.recover();
    assert_eq!(
        found(&recovery),
        [(1, 23, 0), (2, 41, a.len() as u64)],
        "{recovery:?}"
    );
    assert!(recovery.is_complete(), "{recovery:?}");
    assert!(recovery.recordings().all(|r| r.had_summary));
    let second = Recording::open(&joined.path("to-2.mcap")).expect("complete");
    assert_eq!(second.config_toml(), Some("run = 2\n"));
}

#[test]
fn equal_recordings_are_each_recovered() {
    let a = recording(1, 23);
    let joined = Joined::of(&[&a, &a, &a]);
    let recovery = joined.recover();
    let length = a.len() as u64;
    assert_eq!(
        found(&recovery),
        [(1, 23, 0), (1, 23, length), (1, 23, 2 * length)]
    );
    assert!(recovery.is_complete());
}

#[test]
fn cut_recording_before_a_complete_one_ends_where_that_begins() {
    let (a, b) = (recording(1, 23), recording(2, 41));
    let mut random = Random(1);
    let data_end = records(&a).last().expect("records").1;
    let boundaries = records(&a).into_iter().map(|record| record.1);
    let random_cuts: Vec<usize> = (0..40).map(|_| 1 + random.below(a.len() - 1)).collect();
    for cut in boundaries.chain(random_cuts) {
        let joined = Joined::of(&[&a[..cut], &b]);
        let recovery = joined.recover();
        let ticks = ticks_before(&a, cut, 23);
        let mut expected = vec![(1, ticks, 0), (2, 41, cut as u64)];
        expected.retain(|(_, ticks, _)| *ticks > 0);
        assert_eq!(found(&recovery), expected, "cut at {cut}");
        let last = recovery.recordings().last().expect("b");
        assert!(last.is_complete(), "cut at {cut}: {last:?}");
        if cut <= data_end {
            assert!(!recovery.is_complete(), "cut at {cut}");
        }
        match (ticks, &recovery.first.cut) {
            (0, _) => assert_eq!(recovery.unused[0].to_byte, cut as u64),
            (_, Some(end)) => assert_eq!(end.of_bytes, cut as u64),
            (_, None) => assert!(cut > data_end),
        }
    }
}

#[test]
fn cut_recording_behind_a_complete_one_is_recovered_up_to_its_cut() {
    let (a, b) = (recording(1, 23), recording(2, 41));
    let mut random = Random(2);
    for _ in 0..40 {
        let cut = 1 + random.below(b.len() - 1);
        let joined = Joined::of(&[&a, &b[..cut]]);
        let recovery = joined.recover();
        let ticks = ticks_before(&b, cut, 41);
        let mut expected = vec![(1, 23, 0), (2, ticks, a.len() as u64)];
        expected.retain(|(_, ticks, _)| *ticks > 0);
        assert_eq!(found(&recovery), expected, "cut at {cut}");
        assert!(recovery.first.is_complete());
        if ticks == 0 {
            assert_eq!(recovery.unused[0].from_byte, a.len() as u64);
            assert_eq!(recovery.unused[0].to_byte, joined.bytes);
        }
        if ticks < 41 {
            assert!(!recovery.is_complete(), "cut at {cut}: {recovery:?}");
        }
    }
}

#[test]
fn recordings_between_other_bytes_are_found_and_the_bytes_are_reported() {
    let runs = [recording(1, 23), recording(2, 41), recording(3, 8)];
    let mut random = Random(3);
    for case in 0..12 {
        let (mut parts, mut starts, mut at) = (Vec::new(), Vec::new(), 0);
        for run in &runs {
            let count = 1 + random.below(3000);
            let other = match case % 3 {
                0 => vec![0; count],
                1 => random.bytes(count),
                // The head of a chunk whose length reaches into the next recording, and a magic without a header.
                _ => [&[op::CHUNK, 200, 9, 0, 0, 0, 0, 0, 0, 7][..], mcap::MAGIC].concat(),
            };
            starts.push((at + other.len()) as u64);
            at += other.len() + run.len();
            parts.extend([other, run.clone()]);
        }
        let parts: Vec<&[u8]> = parts.iter().map(Vec::as_slice).collect();
        let joined = Joined::of(&parts);
        let recovery = joined.recover();
        let expected = [(1, 23, starts[0]), (2, 41, starts[1]), (3, 8, starts[2])];
        assert_eq!(found(&recovery), expected, "case {case}");
        assert!(recovery.recordings().all(Recovered::is_complete));
        let unused: Vec<u64> = recovery.unused.iter().map(|part| part.to_byte).collect();
        assert_eq!(unused, starts, "case {case}");
        assert!(!recovery.is_complete());
    }
}

#[test]
fn bytes_after_the_end_of_a_recording_are_reported() {
    let a = recording(1, 23);
    for tail in [&[0; 5000][..], &a[..300], mcap::MAGIC] {
        let joined = Joined::of(&[&a, tail]);
        let recovery = joined.recover();
        assert_eq!(found(&recovery), [(1, 23, 0)]);
        assert!(recovery.first.is_complete() && !recovery.is_complete());
        let [unused] = recovery.unused.as_slice() else {
            panic!("{:?}", recovery.unused);
        };
        assert_eq!(
            (unused.from_byte, unused.to_byte),
            (a.len() as u64, joined.bytes)
        );
    }
}

#[test]
fn recording_without_ticks_is_reported_and_those_around_it_are_recovered() {
    let (a, idle, b) = (recording(1, 23), recording(9, 0), recording(2, 41));
    let joined = Joined::of(&[&a, &idle, &b]);
    let recovery = joined.recover();
    let second = (a.len() + idle.len()) as u64;
    assert_eq!(found(&recovery), [(1, 23, 0), (2, 41, second)]);
    assert!(!recovery.is_complete());
    assert!(
        recovery.unused[0].why.contains("no ticks"),
        "{:?}",
        recovery.unused
    );
}

#[test]
fn recording_inside_an_attachment_is_no_recording_of_the_file() {
    let nested = recording(7, 60);
    let (a, b) = (recording_with(1, 23, &nested), recording(2, 41));
    let joined = Joined::of(&[&a, &b]);
    let recovery = joined.recover();
    assert_eq!(found(&recovery), [(1, 23, 0), (2, 41, a.len() as u64)]);
    assert!(recovery.is_complete(), "{recovery:?}");
    let new = Recording::open(&recovery.first.totals.path).expect("complete");
    let attachment = new.attachment("result").expect("recovered");
    assert!(attachment.data == nested, "the attachment is unchanged");
}

#[test]
fn recording_inside_a_damaged_attachment_is_no_recording_of_the_file() {
    let nested = recording(7, 60);
    let (a, b) = (recording_with(1, 23, &nested), recording(2, 41));
    let at = |part: &[u8]| a.windows(part.len()).position(|window| window == part);
    let inside = at(&nested).expect("the attachment");
    let mut random = Random(4);
    for _ in 0..40 {
        let mut damaged = a.clone();
        damaged[inside + random.below(nested.len())] ^= 1 << random.below(8);
        let joined = Joined::of(&[&damaged, &b]);
        let recovery = joined.recover();
        assert_eq!(found(&recovery), [(1, 23, 0), (2, 41, a.len() as u64)]);
        assert_eq!(recovery.first.missing_attachments, ["result"]);
        assert!(!recovery.is_complete());
    }
}

#[test]
fn recording_whose_start_is_damaged_is_not_mixed_with_the_one_before_it() {
    let (a, b) = (recording(1, 23), recording(2, 41));
    let heads: Vec<usize> = records(&b).iter().take(4).map(|record| record.1).collect();
    let cut = records(&a)
        .iter()
        .filter(|record| record.2 == op::CHUNK)
        .nth(2)
        .expect("chunks")
        .1
        - 7;
    for before in [&a[..], &a[..cut]] {
        for lost in [3, 8, 20].into_iter().chain(heads.iter().copied()) {
            let mut zeroed = b.clone();
            zeroed[..lost].fill(0);
            for behind in [&zeroed[..], &b[lost..]] {
                let joined = Joined::of(&[before, behind]);
                let recovery = joined.recover();
                let found = found(&recovery);
                let case = format!("{lost} bytes lost: {found:?}");
                let a_ticks = ticks_before(&a, before.len(), 23);
                assert_eq!((found[0].0, found[0].1), (1, a_ticks), "{case}");
                assert_eq!((found[1].0, found[1].1, found.len()), (2, 41, 2), "{case}");
                // Without its own magic, the header follows the magic at the end of a: then only the magic is missing.
                let follows_magic = lost == 8 && behind.len() < b.len() && before.len() == a.len();
                assert_eq!(recovery.is_complete(), follows_magic, "{case}");
            }
        }
    }
}

#[test]
fn damage_within_each_of_several_recordings_loses_one_chunk_each() {
    let (a, b) = (recording(1, 23), recording(2, 41));
    let chunk = |bytes: &[u8]| {
        let chunks = records(bytes);
        let chunks: Vec<_> = chunks
            .iter()
            .filter(|record| record.2 == op::CHUNK)
            .collect();
        (chunks[2].0 + chunks[2].1) / 2
    };
    let (mut damaged_a, mut damaged_b) = (a.clone(), b.clone());
    damaged_a[chunk(&a)] ^= 1;
    damaged_b[chunk(&b)] ^= 1;
    let joined = Joined::of(&[&damaged_a, &damaged_b]);
    let recovery = joined.recover();
    assert_eq!(found(&recovery), [(1, 18, 0), (2, 36, a.len() as u64)]);
    for (recovered, from) in recovery.recordings().zip([0, a.len()]) {
        let [damage] = recovered.damage.as_slice() else {
            panic!("{:?}", recovered.damage);
        };
        let damaged_byte = (from + chunk(if from == 0 { &a } else { &b })) as u64;
        assert!((damage.from_byte..damage.to_byte).contains(&damaged_byte));
        assert_eq!(recovered.missing_tick_count(), TICKS_PER_CHUNK);
    }
}

#[test]
fn recovery_never_overwrites_a_file() {
    let joined = Joined::of(&[&recording(1, 23), &recording(2, 41)]);
    std::fs::write(joined.path("to-2.mcap"), "of another run").expect("room");
    let recovery = joined.try_recover().expect("two recordings");
    assert_eq!(recovery.others[0].totals.path, joined.path("to-3.mcap"));
    let kept = std::fs::read(joined.path("to-2.mcap")).expect("kept");
    assert_eq!(kept, b"of another run");
    let refused = joined.try_recover().expect_err("to.mcap exists");
    assert!(
        matches!(refused, RecordingError::Exists { .. }),
        "{refused}"
    );
}

fn assert_opening_names_the_next_recording(path: &Path, at_byte: usize) {
    let refused = Recording::open(path).expect_err("two recordings");
    let text = refused.to_string();
    let expected = format!("more than one recording, another one begins at byte {at_byte};");
    assert!(
        text.contains(&expected) && text.contains("bench recover"),
        "{text}"
    );
}

#[test]
fn opening_a_file_with_several_recordings_says_so() {
    let nested = recording(7, 60);
    let (a, b) = (recording_with(1, 23, &nested), recording(2, 41));
    let mut damaged = a.clone();
    damaged[a.len() / 2] ^= 1;
    for before in [&a, &damaged] {
        let joined = Joined::of(&[before, &b]);
        assert_opening_names_the_next_recording(&joined.path("joined.mcap"), a.len());
    }
    let short = recording(1, 23);
    let mut random = Random(5);
    for _ in 0..40 {
        let cut = 9 + random.below(short.len() - 9);
        let joined = Joined::of(&[&short[..cut], &b]);
        assert_opening_names_the_next_recording(&joined.path("joined.mcap"), cut);
    }
}

#[test]
fn opening_a_file_that_goes_on_after_its_recording_says_so() {
    let joined = Joined::of(&[&recording(1, 23), &[0; 100]]);
    let refused = Recording::open(&joined.path("joined.mcap")).expect_err("more bytes");
    let text = refused.to_string();
    assert!(text.contains("goes on after the end"), "{text}");
}

#[test]
fn every_tick_of_a_random_file_is_recovered() {
    let mut random = Random(6);
    for case in 0..30 {
        let (mut bytes, mut expected) = (Vec::new(), Vec::new());
        for run in 1..=1 + random.below(4) as u32 {
            let ticks = 1 + random.below(40) as u64;
            let recording = recording(run, ticks);
            let length = match random.below(3) {
                0 => 1 + random.below(recording.len()),
                _ => recording.len(),
            };
            expected.push((
                run,
                ticks_before(&recording, length, ticks),
                bytes.len() as u64,
            ));
            bytes.extend(&recording[..length]);
        }
        expected.retain(|(_, ticks, _)| *ticks > 0);
        let joined = Joined::of(&[&bytes]);
        match joined.try_recover() {
            Ok(recovery) => assert_eq!(found(&recovery), expected, "case {case}"),
            Err(error) => assert!(expected.is_empty(), "case {case}: {error}"),
        }
    }
}
