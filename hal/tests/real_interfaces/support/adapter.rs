//! An emulated CAN adapter behind a pseudo terminal, used by the kernel's slcan driver: a bus with injected errors.
//!
//! ```text
//! t IIIL DD..      a frame, both ways          e1R      an error of the receiver
//! s S RRR TTT      state (a active, w warning, p passive, b bus-off) and both error counters
//! ```

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsRawFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bench_hal::can::bus::{BusError, BusEvent, CanBus, Port};
use bench_hal::can::{CanFrame, Id};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use socketcan::CanInterface;

use super::BIT_RATE;

/// Number of the line discipline in `linux/tty.h`.
const N_SLCAN: libc::c_int = 17;

/// An adapter, its interface and its line.
pub struct Adapter {
    pub name: String,
    interface: CanInterface,
    far_side: FarSide,
    _terminal: File,
}

/// The bus behind the adapter. It has one other node: the endpoint opened last.
#[derive(Clone)]
pub struct FarSide {
    line: Arc<Mutex<File>>,
    node: Arc<Mutex<Option<Sender<CanFrame>>>>,
    is_off: Arc<AtomicBool>,
}

impl Adapter {
    /// An adapter whose interface is up at [`BIT_RATE`].
    pub fn new() -> Adapter {
        let pty = openpty(None, None).unwrap();
        let mut raw = tcgetattr(&pty.slave).unwrap();
        cfmakeraw(&mut raw);
        tcsetattr(&pty.slave, SetArg::TCSANOW, &raw).unwrap();
        let (master, terminal) = (File::from(pty.master), File::from(pty.slave));
        let received = master.try_clone().unwrap();
        let far_side = FarSide {
            line: Arc::new(Mutex::new(master)),
            node: Arc::default(),
            is_off: Arc::default(),
        };
        std::thread::spawn({
            let far_side = far_side.clone();
            move || far_side.read_frames(received)
        });
        let name = attach(&terminal);
        let interface = CanInterface::open(&name).unwrap();
        interface.set_bitrate(BIT_RATE, None).unwrap();
        interface.bring_up().unwrap();
        Adapter {
            name,
            interface,
            far_side,
            _terminal: terminal,
        }
    }

    pub fn far_side(&self) -> FarSide {
        self.far_side.clone()
    }

    /// Sends a line from the adapter to the kernel.
    pub fn send(&self, line: &str) {
        self.far_side.write(line);
    }

    /// The controller enters bus-off: 255 transmit errors, and no frame passes in either direction.
    pub fn enter_bus_off(&self) {
        self.far_side.is_off.store(true, Ordering::Release);
        self.send("sb000255");
    }

    /// `ip link set IFACE down` and up again, which is the only way out of bus-off with slcan.
    pub fn restart_interface(&self) {
        self.interface.bring_down().unwrap();
        self.far_side.is_off.store(false, Ordering::Release);
        self.interface.bring_up().unwrap();
    }
}

/// Makes the terminal a CAN interface, as slcand does, and returns its name.
fn attach(terminal: &File) -> String {
    let (fd, mut name) = (terminal.as_raw_fd(), [0u8; libc::IFNAMSIZ]);
    // SAFETY: the descriptor is open, and the pointed-to integer outlives the call.
    let attached = unsafe { libc::ioctl(fd, libc::TIOCSETD, &N_SLCAN) };
    assert_eq!(attached, 0, "a kernel with slcan: use .ci/vm/check");
    // SAFETY: the kernel writes a name with its terminating zero, at most IFNAMSIZ bytes.
    let named = unsafe { libc::ioctl(fd, libc::SIOCGIFNAME as libc::Ioctl, name.as_mut_ptr()) };
    assert_eq!(named, 0, "the name of the interface");
    std::ffi::CStr::from_bytes_until_nul(&name)
        .unwrap()
        .to_str()
        .unwrap()
        .to_owned()
}

impl FarSide {
    fn write(&self, line: &str) {
        write!(self.line.lock().unwrap(), "{line}\r").unwrap();
    }

    /// Reads the lines that the kernel sends to the adapter. It must always read, because the kernel waits until its bytes are
    /// read.
    fn read_frames(self, mut line: File) {
        let (mut bytes, mut text) = ([0; 256], String::new());
        while let Ok(count) = line.read(&mut bytes) {
            text.push_str(std::str::from_utf8(&bytes[..count]).unwrap());
            while let Some(end) = text.find('\r') {
                let line: String = text.drain(..=end).collect();
                self.forward(&line);
            }
        }
    }

    fn forward(&self, line: &str) {
        let frame = parse(line).filter(|_| !self.is_off.load(Ordering::Acquire));
        if let (Some(frame), Some(node)) = (frame, &*self.node.lock().unwrap()) {
            let _ = node.send(frame); // there may be no receiver
        }
    }
}

fn parse(line: &str) -> Option<CanFrame> {
    let digits = line.trim_end().strip_prefix('t')?;
    let id = u16::from_str_radix(digits.get(..3)?, 16).ok()?;
    let pairs = digits.get(4..)?.as_bytes().chunks_exact(2);
    let bytes = pairs.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok());
    CanFrame::from_slice(Id::standard(id), &bytes.collect::<Option<Vec<u8>>>()?)
}

impl Port for FarSide {
    fn endpoint(&self, _ids: &[Id]) -> Result<Box<dyn CanBus>, BusError> {
        let (sender, frames) = channel();
        *self.node.lock().unwrap() = Some(sender);
        Ok(Box::new(FarNode {
            far_side: self.clone(),
            frames,
        }))
    }
}

struct FarNode {
    far_side: FarSide,
    frames: Receiver<CanFrame>,
}

impl CanBus for FarNode {
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        if !self.far_side.is_off.load(Ordering::Acquire) {
            let data: String = frame
                .data()
                .iter()
                .map(|byte| format!("{byte:02X}"))
                .collect();
            self.far_side.write(&format!(
                "t{:03X}{}{data}",
                frame.id().raw(),
                frame.data().len()
            ));
        }
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<BusEvent>, BusError> {
        Ok(self.frames.recv_timeout(timeout).ok().map(BusEvent::Frame))
    }
}
