//! A wire to an Uno: a connection that carries bytes both ways.

use super::LinkError;
use std::io::{ErrorKind, Read, Write};

/// A connection that carries bytes both ways.
///
/// A read waits some hundredths of a second at most, and then fails with [`ErrorKind::TimedOut`]. A read of zero
/// bytes, and any other error, means that the port is gone.
pub trait Port: Read + Write {}

impl<T: Read + Write + ?Sized> Port for T {}

/// An open port.
pub struct Wire {
    port: Box<dyn Port>,
    /// Whether opening it has reset the Uno.
    pub(crate) resets: bool,
    /// The serial port again, to discard what it has not sent.
    #[cfg(not(target_arch = "wasm32"))]
    serial: Option<Box<dyn serialport::SerialPort>>,
}

impl Wire {
    /// Opens a port by its name, or that of the only Uno.
    ///
    /// # Errors
    /// If the port is absent, busy or forbidden.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn open(port: Option<&str>) -> Result<Self, LinkError> {
        let name = port.map_or_else(|| super::find_uno(None), |port| Ok(port.to_owned()))?;
        let (port, resets) = super::port::open(&name)?;
        // Without a second handle, a stalled port may send its bytes later.
        let serial = port.try_clone().ok();
        Ok(Self { serial, ..Self::over(port, resets) })
    }

    /// A wire over a port that is open already; `resets` says whether opening it has reset the Uno.
    pub fn over(port: impl Port + 'static, resets: bool) -> Self {
        Self {
            port: Box::new(port),
            resets,
            #[cfg(not(target_arch = "wasm32"))]
            serial: None,
        }
    }

    /// The bytes that come within a fiftieth of a second; none if the line is silent.
    pub(crate) fn read(&mut self) -> Result<Vec<u8>, LinkError> {
        let mut bytes = [0; 256];
        match self.port.read(&mut bytes) {
            Ok(0) => Err(LinkError::Gone(ErrorKind::UnexpectedEof.into())),
            Ok(count) => Ok(bytes[..count].to_vec()),
            Err(error) => match error.kind() {
                ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted => Ok(Vec::new()),
                _ => Err(LinkError::Gone(error)),
            },
        }
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        if bytes.is_empty() {
            return Ok(());
        }
        self.port.write_all(bytes).map_err(LinkError::Gone)?;
        match self.port.flush() {
            // The system has all bytes: a program that was stopped meanwhile has lost no port.
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(()),
            flushed => flushed.map_err(LinkError::Gone),
        }
    }

    /// Discards what the port has not sent yet: the machine must not get a command after its sender has given it up.
    pub(crate) fn discard_unsent(&self) {
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(serial) = &self.serial {
            // The port is given up in any case.
            let _ = serial.clear(serialport::ClearBuffer::Output);
        }
    }
}
