//! The reading and writing side of a transfer, without a socket or a clock.

use super::{AbortCode, Address, Answer, Part, Request, Start};

/// Longest transfer taken, in bytes: a node that sends segments for ever is given up.
const LONGEST: usize = 4096;

/// One transfer. The caller sends what it is told to, hands in what comes from the node, and keeps the time.
///
/// ```
/// use bench_hal::can::sdo::{Address, Answer, Client, Part, Progress, Start};
///
/// let address = Address::new(0x6075, 0);
/// let (mut client, _request) = Client::upload(address);
/// let answer = Answer::Uploaded(address, Start::Expedited(Part::new(&4000u32.to_le_bytes())));
/// assert_eq!(client.answer(&answer.encode()), Progress::Done(vec![0xA0, 0x0F, 0, 0]));
/// ```
#[derive(Debug)]
pub struct Client {
    address: Address,
    state: State,
}

#[derive(Debug)]
enum State {
    /// The upload was asked for.
    Asked,
    /// Segments come in.
    Reading {
        data: Vec<u8>,
        size: Option<u32>,
        toggle: bool,
    },
    /// The download was begun; what is left goes in segments.
    Began { data: Vec<u8>, expedited: bool },
    /// Segments go out; `sent` bytes so far, the segment with `toggle` awaits its answer.
    Writing {
        data: Vec<u8>,
        sent: usize,
        toggle: bool,
    },
    /// Over.
    Finished,
}

/// What to do after an answer.
#[derive(Debug, PartialEq, Eq)]
pub enum Progress {
    /// Send these eight bytes and wait for the next answer.
    Send([u8; 8]),
    /// Over: the bytes read, empty after writing.
    Done(Vec<u8>),
    /// Not for this transfer, for example the late answer to an earlier one. Wait on.
    Ignored,
    /// Over without success; send the bytes if there are any, so that the server gives up too.
    Failed(Failure, Option<[u8; 8]>),
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The node gave up.
    Aborted(AbortCode),
    /// The node broke the protocol; it was told this.
    Protocol(AbortCode),
}

impl Client {
    /// Begins to read; send the bytes.
    pub fn upload(address: Address) -> (Client, [u8; 8]) {
        (
            Client {
                address,
                state: State::Asked,
            },
            Request::Upload(address).encode(),
        )
    }

    /// Begins to write; send the bytes. One to four bytes go expedited, all else in segments.
    pub fn download(address: Address, data: &[u8]) -> (Client, [u8; 8]) {
        let expedited = (1..=4).contains(&data.len());
        let start = match expedited {
            true => Start::Expedited(Part::new(data)),
            false => Start::Segmented(Some(data.len() as u32)),
        };
        let state = State::Began {
            data: data.to_vec(),
            expedited,
        };
        (
            Client { address, state },
            Request::Download(address, start).encode(),
        )
    }

    /// Gives up because no answer came in time: the bytes to send.
    pub fn time_out(&mut self) -> [u8; 8] {
        self.state = State::Finished;
        Request::Abort(self.address, AbortCode::TIMEOUT).encode()
    }

    /// Takes what came from the node.
    pub fn answer(&mut self, data: &[u8]) -> Progress {
        let Some(answer) = Answer::decode(data) else {
            return Progress::Ignored;
        };
        match (std::mem::replace(&mut self.state, State::Finished), answer) {
            (State::Finished, _) => Progress::Ignored,
            (_, Answer::Abort(address, code)) if address == self.address => {
                Progress::Failed(Failure::Aborted(code), None)
            }
            (State::Asked, Answer::Uploaded(address, start)) if address == self.address => {
                self.begin_reading(start)
            }
            (
                State::Reading { data, size, toggle },
                Answer::UploadedSegment {
                    toggle: theirs,
                    last,
                    part,
                },
            ) => {
                if toggle != theirs {
                    return self.protest(AbortCode::TOGGLE);
                }
                self.read_on(data, size, toggle, last, part)
            }
            (State::Began { data, expedited }, Answer::Downloaded(address))
                if address == self.address =>
            {
                if expedited {
                    Progress::Done(Vec::new())
                } else {
                    self.write_on(data, 0, false)
                }
            }
            (
                State::Writing { data, sent, toggle },
                Answer::DownloadedSegment { toggle: theirs },
            ) => {
                if toggle != theirs {
                    return self.protest(AbortCode::TOGGLE);
                }
                let done = sent >= data.len();
                if done {
                    Progress::Done(Vec::new())
                } else {
                    self.write_on(data, sent, !toggle)
                }
            }
            (state, _) => {
                self.state = state;
                Progress::Ignored
            }
        }
    }

    fn protest(&self, code: AbortCode) -> Progress {
        Progress::Failed(
            Failure::Protocol(code),
            Some(Request::Abort(self.address, code).encode()),
        )
    }

    fn begin_reading(&mut self, start: Start) -> Progress {
        match start {
            Start::Expedited(part) => Progress::Done(part.bytes().to_vec()),
            Start::Segmented(Some(size)) if size as usize > LONGEST => {
                self.protest(AbortCode::MEMORY)
            }
            Start::Segmented(size) => {
                self.state = State::Reading {
                    data: Vec::new(),
                    size,
                    toggle: false,
                };
                Progress::Send(Request::UploadSegment { toggle: false }.encode())
            }
        }
    }

    fn read_on(
        &mut self,
        mut data: Vec<u8>,
        size: Option<u32>,
        toggle: bool,
        last: bool,
        part: Part,
    ) -> Progress {
        data.extend_from_slice(part.bytes());
        if data.len() > LONGEST {
            return self.protest(AbortCode::MEMORY);
        }
        if !last {
            self.state = State::Reading {
                data,
                size,
                toggle: !toggle,
            };
            return Progress::Send(Request::UploadSegment { toggle: !toggle }.encode());
        }
        match size {
            Some(size) if size as usize != data.len() => self.protest(AbortCode::LENGTH),
            _ => Progress::Done(data),
        }
    }

    fn write_on(&mut self, data: Vec<u8>, sent: usize, toggle: bool) -> Progress {
        let part = Part::new(data.get(sent..).unwrap_or_default());
        let sent = sent + part.bytes().len();
        let last = sent >= data.len();
        self.state = State::Writing { data, sent, toggle };
        Progress::Send(Request::DownloadSegment { toggle, last, part }.encode())
    }
}
