use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;

#[derive(Default)]
struct Values(BTreeMap<Address, Vec<u8>>);

impl Dictionary for Values {
    fn read(&self, address: Address) -> Result<Vec<u8>, AbortCode> {
        self.0.get(&address).cloned().ok_or(AbortCode::NO_OBJECT)
    }
    fn write(&mut self, address: Address, value: &[u8]) -> Result<(), AbortCode> {
        self.0.insert(address, value.to_vec());
        Ok(())
    }
}

const NAME: Address = Address::new(0x1008, 0);

/// Runs a transfer to its end and counts the frames sent by the client.
fn run(mut client: Client, first: [u8; 8], values: &mut Values) -> (Progress, usize) {
    let (mut server, mut request, mut frames) = (Server::default(), first, 1);
    loop {
        let answer = server
            .answer(&request, values)
            .expect("a request of eight bytes is answered");
        match client.answer(&answer) {
            Progress::Send(next) => (request, frames) = (next, frames + 1),
            end => return (end, frames),
        }
    }
}

#[test]
fn expedited_frames_are_the_bytes_of_the_standard() {
    // Computed by hand from the bit table of CiA 301, 7.2.4.3: 001 0 00 1 1 = 0x23 for four bytes, 0x2B for two, 0x2F for one.
    let address = Address::new(0x1017, 0);
    let download = |data: &[u8]| Client::download(address, data).1;
    assert_eq!(
        download(&[0xE8, 0x03]),
        [0x2B, 0x17, 0x10, 0, 0xE8, 0x03, 0, 0]
    );
    assert_eq!(download(&[1]), [0x2F, 0x17, 0x10, 0, 1, 0, 0, 0]);
    assert_eq!(download(&[1, 2, 3, 4])[0], 0x23);
    assert_eq!(
        Client::upload(Address::new(0x1018, 1)).1,
        [0x40, 0x18, 0x10, 1, 0, 0, 0, 0]
    );
    let answer = Answer::Uploaded(
        Address::new(0x1018, 1),
        Start::Expedited(Part::new(&[0x6E, 1, 0, 0])),
    );
    assert_eq!(answer.encode(), [0x43, 0x18, 0x10, 1, 0x6E, 1, 0, 0]);
    let abort = Request::Abort(NAME, AbortCode::TIMEOUT);
    assert_eq!(abort.encode(), [0x80, 0x08, 0x10, 0, 0, 0, 0x04, 0x05]);
}

#[test]
fn segments_alternate_the_toggle_bit_and_mark_the_last() {
    // Eleven bytes: one segment of seven (0x00), one of four (toggle 0x10, three unused 0x06, last 0x01).
    let mut values = Values(BTreeMap::from([(NAME, b"hello world".to_vec())]));
    let mut server = Server::default();
    let mut ask = |request: [u8; 8]| server.answer(&request, &mut values).unwrap();
    assert_eq!(
        ask(Request::Upload(NAME).encode()),
        [0x41, 0x08, 0x10, 0, 11, 0, 0, 0]
    );
    assert_eq!(&ask([0x60, 0, 0, 0, 0, 0, 0, 0]), b"\x00hello w");
    assert_eq!(&ask([0x70, 0, 0, 0, 0, 0, 0, 0]), b"\x17orld\0\0\0");
}

#[test]
fn a_repeated_toggle_bit_aborts_on_both_sides() {
    let mut values = Values(BTreeMap::from([(NAME, vec![7; 20])]));
    let mut server = Server::default();
    server.answer(&Request::Upload(NAME).encode(), &mut values);
    server.answer(
        &Request::UploadSegment { toggle: false }.encode(),
        &mut values,
    );
    let answer = server
        .answer(
            &Request::UploadSegment { toggle: false }.encode(),
            &mut values,
        )
        .unwrap();
    assert_eq!(
        Answer::decode(&answer),
        Some(Answer::Abort(NAME, AbortCode::TOGGLE))
    );

    let (mut client, _) = Client::upload(NAME);
    client.answer(&Answer::Uploaded(NAME, Start::Segmented(Some(14))).encode());
    let wrong = Answer::UploadedSegment {
        toggle: true,
        last: false,
        part: Part::new(&[1; 7]),
    };
    let farewell = Request::Abort(NAME, AbortCode::TOGGLE).encode();
    assert_eq!(
        client.answer(&wrong.encode()),
        Progress::Failed(Failure::Protocol(AbortCode::TOGGLE), Some(farewell)),
        "the server is told"
    );
}

#[test]
fn rejects_a_transfer_with_another_length_than_indicated() {
    let (mut client, _) = Client::upload(NAME);
    client.answer(&Answer::Uploaded(NAME, Start::Segmented(Some(9))).encode());
    let short = Answer::UploadedSegment {
        toggle: false,
        last: true,
        part: Part::new(&[1; 7]),
    };
    assert!(matches!(
        client.answer(&short.encode()),
        Progress::Failed(Failure::Protocol(AbortCode::LENGTH), Some(_))
    ));

    let (mut server, mut values) = (Server::default(), Values::default());
    server.answer(
        &Request::Download(NAME, Start::Segmented(Some(9))).encode(),
        &mut values,
    );
    let short = Request::DownloadSegment {
        toggle: false,
        last: true,
        part: Part::new(&[1; 7]),
    };
    let answer = server.answer(&short.encode(), &mut values).unwrap();
    assert_eq!(
        Answer::decode(&answer),
        Some(Answer::Abort(NAME, AbortCode::LENGTH))
    );
    assert!(values.0.is_empty(), "half a value is no value");
}

#[test]
fn distinguishes_aborts_from_answers_to_other_requests() {
    let (mut client, _) = Client::upload(NAME);
    let foreign = Address::new(0x6041, 0);
    assert_eq!(
        client.answer(&Answer::Abort(foreign, AbortCode::NO_OBJECT).encode()),
        Progress::Ignored
    );
    let late = Answer::Uploaded(foreign, Start::Expedited(Part::new(&[1])));
    assert_eq!(
        client.answer(&late.encode()),
        Progress::Ignored,
        "a late answer to an earlier request"
    );
    let refused = client.answer(&Answer::Abort(NAME, AbortCode::NO_OBJECT).encode());
    assert_eq!(
        refused,
        Progress::Failed(Failure::Aborted(AbortCode::NO_OBJECT), None)
    );
}

#[test]
fn aborts_an_endless_upload() {
    let (mut client, _) = Client::upload(NAME);
    client.answer(&Answer::Uploaded(NAME, Start::Segmented(None)).encode());
    let mut toggle = false;
    for frames in 0.. {
        assert!(frames < 1000, "4096 bytes are 586 segments");
        let more = Answer::UploadedSegment {
            toggle,
            last: false,
            part: Part::new(&[0; 7]),
        };
        match client.answer(&more.encode()) {
            Progress::Send(_) => toggle = !toggle,
            end => {
                assert!(matches!(
                    end,
                    Progress::Failed(Failure::Protocol(AbortCode::MEMORY), _)
                ));
                break;
            }
        }
    }
}

#[test]
fn rejects_block_transfer_with_an_abort_code() {
    let answer = Server::default()
        .answer(&[0xC2, 0x08, 0x10, 0, 0, 0, 0, 0], &mut Values::default())
        .unwrap();
    assert!(matches!(
        Answer::decode(&answer),
        Some(Answer::Abort(_, AbortCode::COMMAND))
    ));
}

proptest! {
    #[test]
    fn download_needs_the_minimum_of_frames_and_upload_returns_the_data(data in proptest::collection::vec(any::<u8>(), 0..200)) {
        let mut values = Values::default();
        let (client, first) = Client::download(NAME, &data);
        let (end, frames) = run(client, first, &mut values);
        prop_assert_eq!(end, Progress::Done(vec![]));
        let segments = if (1..=4).contains(&data.len()) { 0 } else { data.len().div_ceil(7).max(1) };
        prop_assert_eq!(frames, 1 + segments);
        let (client, first) = Client::upload(NAME);
        prop_assert_eq!(run(client, first, &mut values).0, Progress::Done(data));
    }

    #[test]
    fn decoding_inverts_encoding(bytes in any::<[u8; 8]>()) {
        if let Some(request) = Request::decode(&bytes) {
            prop_assert_eq!(Request::decode(&request.encode()), Some(request));
        }
        if let Some(answer) = Answer::decode(&bytes) {
            prop_assert_eq!(Answer::decode(&answer.encode()), Some(answer));
        }
    }

    #[test]
    fn random_frames_do_not_panic(
        frames in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..9), 0..60),
        writing in any::<bool>(),
    ) {
        let (mut client, _) = if writing { Client::download(NAME, &[1; 30]) } else { Client::upload(NAME) };
        let (mut server, mut values) = (Server::default(), Values::default());
        for frame in &frames {
            client.answer(frame);
            let answered = server.answer(frame, &mut values).is_some();
            prop_assert!(!answered || frame.len() == 8);
        }
    }
}
