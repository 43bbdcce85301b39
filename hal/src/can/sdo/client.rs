//! The client of a transfer, without socket and clock.

use super::{AbortCode, Address, Answer, Part, Request, Start};

/// Longest permitted transfer in bytes, so that the transfer ends if a node sends segments without end.
const LONGEST: usize = 4096;

/// One transfer. The caller sends the returned bytes, passes the data of the node, and monitors the time.
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
    /// The upload was requested.
    Requested,
    /// Segments are being received.
    Reading(Upload),
    /// The download was started.
    Started(Download),
    /// A segment was sent; its answer is awaited.
    Writing(Download),
    /// The transfer has ended.
    Finished,
}

/// A segmented upload.
#[derive(Debug)]
struct Upload {
    data: Vec<u8>,
    size: Option<u32>,
    toggle: bool,
}

/// A download; `toggle` is that of the segment whose answer is awaited, `sent` the number of bytes sent in segments.
#[derive(Debug)]
struct Download {
    data: Vec<u8>,
    is_expedited: bool,
    sent: usize,
    toggle: bool,
}

/// The next step after an answer.
#[derive(Debug, PartialEq, Eq)]
pub enum Progress {
    /// Send these eight bytes, then wait for the next answer.
    Send([u8; 8]),
    /// The transfer is complete: the bytes read, or no bytes after writing.
    Done(Vec<u8>),
    /// The data do not belong to this transfer, for example a late answer to an earlier one. Keep waiting.
    Ignored,
    /// The transfer failed. Send the bytes, if there are any, so that the server aborts it, too.
    Failed(Failure, Option<[u8; 8]>),
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The node aborted the transfer.
    Aborted(AbortCode),
    /// The node violated the protocol; the transfer is aborted with this code.
    Protocol(AbortCode),
}

impl Client {
    /// Starts reading; the bytes are to be sent.
    pub fn upload(address: Address) -> (Client, [u8; 8]) {
        (
            Client {
                address,
                state: State::Requested,
            },
            Request::Upload(address).encode(),
        )
    }

    /// Starts writing; the bytes are to be sent. One to four bytes are sent expedited, others in segments.
    pub fn download(address: Address, data: &[u8]) -> (Client, [u8; 8]) {
        let is_expedited = (1..=4).contains(&data.len());
        let start = if is_expedited {
            Start::Expedited(Part::new(data))
        } else {
            Start::Segmented(Some(data.len() as u32))
        };
        let state = State::Started(Download {
            data: data.to_vec(),
            is_expedited,
            sent: 0,
            toggle: false,
        });
        (
            Client { address, state },
            Request::Download(address, start).encode(),
        )
    }

    /// Aborts the transfer after a timeout; the bytes are to be sent.
    pub fn time_out(&mut self) -> [u8; 8] {
        self.state = State::Finished;
        Request::Abort(self.address, AbortCode::TIMEOUT).encode()
    }

    /// Processes data from the node.
    pub fn answer(&mut self, data: &[u8]) -> Progress {
        let Some(answer) = Answer::decode(data) else {
            return Progress::Ignored;
        };
        let state = std::mem::replace(&mut self.state, State::Finished);
        match (state, answer) {
            (State::Finished, _) => Progress::Ignored,
            (_, Answer::Abort(address, code)) if address == self.address => {
                Progress::Failed(Failure::Aborted(code), None)
            }
            (State::Requested, Answer::Uploaded(address, start)) if address == self.address => {
                self.begin_reading(start)
            }
            (State::Started(download), Answer::Downloaded(address)) if address == self.address => {
                self.write_segment(download)
            }
            (State::Reading(upload), Answer::UploadedSegment { toggle, last, part }) => {
                self.read_segment(upload, toggle, last, part)
            }
            (State::Writing(download), Answer::DownloadedSegment { toggle }) => {
                self.continue_writing(download, toggle)
            }
            (state, _) => {
                self.state = state;
                Progress::Ignored
            }
        }
    }

    fn abort(&self, code: AbortCode) -> Progress {
        Progress::Failed(
            Failure::Protocol(code),
            Some(Request::Abort(self.address, code).encode()),
        )
    }

    fn begin_reading(&mut self, start: Start) -> Progress {
        match start {
            Start::Expedited(part) => Progress::Done(part.bytes().to_vec()),
            Start::Segmented(Some(size)) if size as usize > LONGEST => {
                self.abort(AbortCode::MEMORY)
            }
            Start::Segmented(size) => {
                let data = Vec::new();
                self.request_segment(Upload {
                    data,
                    size,
                    toggle: false,
                })
            }
        }
    }

    fn request_segment(&mut self, upload: Upload) -> Progress {
        let toggle = upload.toggle;
        self.state = State::Reading(upload);
        Progress::Send(Request::UploadSegment { toggle }.encode())
    }

    fn read_segment(
        &mut self,
        mut upload: Upload,
        toggle: bool,
        last: bool,
        part: Part,
    ) -> Progress {
        if toggle != upload.toggle {
            return self.abort(AbortCode::TOGGLE);
        }
        upload.data.extend_from_slice(part.bytes());
        if upload.data.len() > LONGEST {
            return self.abort(AbortCode::MEMORY);
        }
        if !last {
            upload.toggle = !toggle;
            return self.request_segment(upload);
        }
        match upload.size {
            Some(size) if size as usize != upload.data.len() => self.abort(AbortCode::LENGTH),
            _ => Progress::Done(upload.data),
        }
    }

    fn continue_writing(&mut self, mut download: Download, toggle: bool) -> Progress {
        if toggle != download.toggle {
            return self.abort(AbortCode::TOGGLE);
        }
        if download.sent >= download.data.len() {
            return Progress::Done(Vec::new());
        }
        download.toggle = !toggle;
        self.write_segment(download)
    }

    /// Sends the next segment; an expedited transfer is complete.
    fn write_segment(&mut self, mut download: Download) -> Progress {
        if download.is_expedited {
            return Progress::Done(Vec::new());
        }
        let part = Part::new(download.data.get(download.sent..).unwrap_or_default());
        download.sent += part.bytes().len();
        let (toggle, last) = (download.toggle, download.sent >= download.data.len());
        self.state = State::Writing(download);
        Progress::Send(Request::DownloadSegment { toggle, last, part }.encode())
    }
}
