//! The server of transfers: one transfer at a time, as CiA 301 requires of the default SDO.

use super::{AbortCode, Address, Answer, Part, Request, Start};

/// Longest permitted value in bytes.
const LONGEST: usize = 4096;

/// The object dictionary of a server.
pub trait Dictionary {
    /// Reads a value, little endian.
    fn read(&self, address: Address) -> Result<Vec<u8>, AbortCode>;
    /// Writes a value, little endian.
    fn write(&mut self, address: Address, value: &[u8]) -> Result<(), AbortCode>;
}

/// Answers requests.
#[derive(Debug, Default)]
pub struct Server {
    transfer: Option<Transfer>,
}

#[derive(Debug)]
struct Transfer {
    address: Address,
    toggle: bool,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Reading { data: Vec<u8>, sent: usize },
    Writing { data: Vec<u8>, size: Option<u32> },
}

impl Server {
    /// The answer to a request; `None` for an abort and for a frame of wrong length. A new request ends an unfinished transfer.
    pub fn answer(&mut self, request: &[u8], dictionary: &mut impl Dictionary) -> Option<[u8; 8]> {
        if request.len() != 8 {
            return None;
        }
        let answer = match Request::decode(request) {
            Some(Request::Abort(..)) => {
                self.transfer = None;
                return None;
            }
            Some(Request::Upload(address)) => self.upload(address, dictionary),
            Some(Request::UploadSegment { toggle }) => self.upload_segment(toggle),
            Some(Request::Download(address, start)) => self.download(address, start, dictionary),
            Some(Request::DownloadSegment { toggle, last, part }) => {
                self.download_segment(toggle, last, part, dictionary)
            }
            None => Err((self.address(), AbortCode::COMMAND)),
        };
        Some(self.settle(answer).encode())
    }

    fn settle(&mut self, answer: Result<Answer, (Address, AbortCode)>) -> Answer {
        answer.unwrap_or_else(|(address, code)| {
            self.transfer = None;
            Answer::Abort(address, code)
        })
    }

    /// The address of the current transfer, zero if there is none.
    fn address(&self) -> Address {
        self.transfer
            .as_ref()
            .map_or(Address::new(0, 0), |transfer| transfer.address)
    }

    fn upload(
        &mut self,
        address: Address,
        dictionary: &impl Dictionary,
    ) -> Result<Answer, (Address, AbortCode)> {
        self.transfer = None;
        let data = dictionary.read(address).map_err(|code| (address, code))?;
        if (1..=4).contains(&data.len()) {
            return Ok(Answer::Uploaded(
                address,
                Start::Expedited(Part::new(&data)),
            ));
        }
        let size = data.len() as u32;
        self.transfer = Some(Transfer {
            address,
            toggle: false,
            kind: Kind::Reading { data, sent: 0 },
        });
        Ok(Answer::Uploaded(address, Start::Segmented(Some(size))))
    }

    fn upload_segment(&mut self, toggle: bool) -> Result<Answer, (Address, AbortCode)> {
        let address = self.address();
        let transfer = self.continued(toggle)?;
        let Kind::Reading { data, sent } = &mut transfer.kind else {
            return Err((address, AbortCode::COMMAND));
        };
        let part = Part::new(data.get(*sent..).unwrap_or_default());
        *sent += part.bytes().len();
        let last = *sent >= data.len();
        if last {
            self.transfer = None;
        }
        Ok(Answer::UploadedSegment { toggle, last, part })
    }

    fn download(
        &mut self,
        address: Address,
        start: Start,
        dictionary: &mut impl Dictionary,
    ) -> Result<Answer, (Address, AbortCode)> {
        self.transfer = None;
        match start {
            Start::Expedited(part) => dictionary
                .write(address, part.bytes())
                .map_err(|code| (address, code))?,
            Start::Segmented(Some(size)) if size as usize > LONGEST => {
                return Err((address, AbortCode::MEMORY));
            }
            Start::Segmented(size) => {
                let kind = Kind::Writing {
                    data: Vec::new(),
                    size,
                };
                self.transfer = Some(Transfer {
                    address,
                    toggle: false,
                    kind,
                });
            }
        }
        Ok(Answer::Downloaded(address))
    }

    fn download_segment(
        &mut self,
        toggle: bool,
        last: bool,
        part: Part,
        dictionary: &mut impl Dictionary,
    ) -> Result<Answer, (Address, AbortCode)> {
        let address = self.address();
        let transfer = self.continued(toggle)?;
        let Kind::Writing { data, size } = &mut transfer.kind else {
            return Err((address, AbortCode::COMMAND));
        };
        data.extend_from_slice(part.bytes());
        if data.len() > LONGEST {
            return Err((address, AbortCode::MEMORY));
        }
        if last {
            if size.is_some_and(|size| size as usize != data.len()) {
                return Err((address, AbortCode::LENGTH));
            }
            dictionary
                .write(address, data)
                .map_err(|code| (address, code))?;
            self.transfer = None;
        }
        Ok(Answer::DownloadedSegment { toggle })
    }

    /// The current transfer, if the segment has the expected toggle bit. The bit is then inverted.
    fn continued(&mut self, toggle: bool) -> Result<&mut Transfer, (Address, AbortCode)> {
        let Some(transfer) = &mut self.transfer else {
            return Err((Address::new(0, 0), AbortCode::COMMAND));
        };
        if transfer.toggle != toggle {
            return Err((transfer.address, AbortCode::TOGGLE));
        }
        transfer.toggle = !toggle;
        Ok(transfer)
    }
}
