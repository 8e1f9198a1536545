//! Whether there is a display to open a window on, asked before the window system is: it would end the process.

use thiserror::Error;

/// There is nowhere to open a window.
#[derive(Debug, Error, Clone, PartialEq, Eq)]
#[error(
    "there is no display to open a window on ({reason}); to play without one, run \
     `resecta run first_cuts --script assets/scripts/first_cuts.ron --out out/`"
)]
pub struct NoDisplay {
    /// What is missing.
    pub reason: String,
}

/// Looks for an X server.
///
/// # Errors
/// [`NoDisplay`] says what is missing.
#[cfg(target_os = "linux")]
pub fn check() -> Result<(), NoDisplay> {
    use std::net::TcpStream;
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixStream};

    let missing = |reason: String| NoDisplay { reason };
    let name = std::env::var("DISPLAY").unwrap_or_default();
    if name.is_empty() {
        return Err(missing("DISPLAY is not set".into()));
    }
    let (host, number) =
        parse(&name).ok_or_else(|| missing(format!("DISPLAY is `{name}`, expected `[host]:number`")))?;
    let is_there = if host.is_empty() || host == "unix" {
        let socket = format!("/tmp/.X11-unix/X{number}");
        let abstract_socket = SocketAddr::from_abstract_name(&socket);
        UnixStream::connect(&socket).is_ok()
            || abstract_socket.is_ok_and(|address| UnixStream::connect_addr(&address).is_ok())
    } else {
        TcpStream::connect((host, 6000 + number)).is_ok()
    };
    if is_there {
        Ok(())
    } else {
        Err(missing(format!("nothing answers on DISPLAY `{name}`")))
    }
}

/// Elsewhere a session without a display is not told from one with: the window system says so.
///
/// # Errors
/// None.
#[cfg(not(target_os = "linux"))]
pub fn check() -> Result<(), NoDisplay> {
    Ok(())
}

/// Host and number of a display's name: `:0`, `host:10.0`.
#[cfg(target_os = "linux")]
fn parse(name: &str) -> Option<(&str, u16)> {
    let (host, display) = name.rsplit_once(':')?;
    let number = display.split('.').next()?.parse().ok()?;
    // Ports above would leave the range.
    (number <= u16::MAX - 6000).then_some((host, number))
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::parse;

    #[test]
    fn names_of_displays_are_read() {
        assert_eq!(parse(":99"), Some(("", 99)));
        assert_eq!(parse("localhost:10.0"), Some(("localhost", 10)));
        for wrong in ["", "host", ":", ":x", ":65000"] {
            assert_eq!(parse(wrong), None, "{wrong}");
        }
    }
}
