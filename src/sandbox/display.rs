//! Whether a window can be opened here, found out before anything tries.
//!
//! Bevy panics where there is no display or no graphics adapter; [`check`] gives the reason
//! in one sentence instead. It opens no window, and leaves nothing behind but [`Reached`].

use bevy::tasks::block_on;

/// Why no window can be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoDisplay {
    /// Neither an X11 nor a Wayland display is named.
    #[error("there is no display: neither DISPLAY nor WAYLAND_DISPLAY is set")]
    NotNamed,
    /// A display is named, but nobody listens there.
    #[error("the display {name} cannot be reached: {reason}")]
    Unreachable {
        /// Value of the variable that names it.
        name: String,
        /// What the system said.
        reason: String,
    },
    /// There is a display but nothing that draws.
    #[error(
        "there is no graphics adapter: neither Vulkan, Metal, Direct3D 12 nor OpenGL offers one"
    )]
    NoAdapter,
    /// The window system or the graphics driver refused when it was asked in earnest.
    #[error("the window could not be opened: {0}")]
    Refused(String),
}

/// A graphics library that offers an adapter. To be kept until the window is open: it may hold a
/// connection to the display, and an X server whose last client leaves resets itself and would
/// refuse the window that comes next.
#[derive(Debug)]
#[must_use = "the display may reset itself when this is dropped"]
pub struct Reached {
    _instance: wgpu::Instance,
}

/// Checks that there is a display and a graphics adapter.
///
/// # Errors
/// The first of the two that is missing.
pub fn check() -> Result<Reached, NoDisplay> {
    check_display()?;
    check_adapter()
}

/// Checks that there is a graphics adapter, which is all that drawing to a file needs.
///
/// # Errors
/// [`NoDisplay::NoAdapter`].
pub fn check_adapter() -> Result<Reached, NoDisplay> {
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapters = block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    if adapters.is_empty() {
        return Err(NoDisplay::NoAdapter);
    }
    Ok(Reached {
        _instance: instance,
    })
}

#[cfg(not(all(unix, not(target_os = "macos"))))]
fn check_display() -> Result<(), NoDisplay> {
    Ok(())
}

#[cfg(all(unix, not(target_os = "macos")))]
fn check_display() -> Result<(), NoDisplay> {
    let named = |variable| std::env::var(variable).ok().filter(|name| !name.is_empty());
    let runtime = named("XDG_RUNTIME_DIR").unwrap_or_default();
    let wayland = named("WAYLAND_DISPLAY").map(|name| socket::reach_wayland(&name, &runtime));
    let x11 = named("DISPLAY").map(|name| socket::reach_x11(&name));
    match (wayland, x11) {
        (Some(Ok(())), _) | (_, Some(Ok(()))) => Ok(()),
        (_, Some(Err(error))) | (Some(Err(error)), None) => Err(error),
        (None, None) => Err(NoDisplay::NotNamed),
    }
}

/// Knocking at the sockets of display servers.
#[cfg(all(unix, not(target_os = "macos")))]
mod socket {
    use super::NoDisplay;
    use std::{
        net::{TcpStream, ToSocketAddrs},
        os::unix::net::UnixStream,
        path::Path,
        time::Duration,
    };

    /// Display servers of a machine listen at TCP ports from this one.
    const X11_PORT: u16 = 6000;
    /// How long a display on another machine may take to answer.
    const PATIENCE: Duration = Duration::from_secs(3);

    pub(super) fn reach_wayland(name: &str, runtime: &str) -> Result<(), NoDisplay> {
        // An absolute name stands for itself.
        connect(&Path::new(runtime).join(name), name)
    }

    pub(super) fn reach_x11(name: &str) -> Result<(), NoDisplay> {
        if name.starts_with('/') {
            // macOS and some sandboxes name the socket itself, with the screen at the end.
            return connect(
                Path::new(name.split_once(':').map_or(name, |(path, _)| path)),
                name,
            );
        }
        let Some((host, number)) = parse(name) else {
            return Err(unreachable(name, "it should look like :0 or host:0"));
        };
        match host {
            "" | "unix" => connect_x11(number, name),
            host => connect_tcp(host, number, name),
        }
    }

    /// Host and number of `host:number.screen`.
    pub(super) fn parse(name: &str) -> Option<(&str, u16)> {
        let (host, display) = name.rsplit_once(':')?;
        let number = display.split('.').next()?.parse().ok()?;
        Some((host, number))
    }

    #[cfg(target_os = "linux")]
    fn connect_x11(number: u16, name: &str) -> Result<(), NoDisplay> {
        use std::os::{linux::net::SocketAddrExt, unix::net::SocketAddr};
        let path = format!("/tmp/.X11-unix/X{number}");
        // Servers listen at an abstract name too, which outlives a missing /tmp.
        let hidden = SocketAddr::from_abstract_name(&path)
            .and_then(|address| UnixStream::connect_addr(&address));
        hidden
            .map(drop)
            .or_else(|_| connect(Path::new(&path), name))
    }

    #[cfg(not(target_os = "linux"))]
    fn connect_x11(number: u16, name: &str) -> Result<(), NoDisplay> {
        connect(Path::new(&format!("/tmp/.X11-unix/X{number}")), name)
    }

    fn connect(path: &Path, name: &str) -> Result<(), NoDisplay> {
        let stream = UnixStream::connect(path);
        stream
            .map(drop)
            .map_err(|error| unreachable(name, &error.to_string()))
    }

    fn connect_tcp(host: &str, number: u16, name: &str) -> Result<(), NoDisplay> {
        let port = X11_PORT.saturating_add(number);
        let addresses = (host, port)
            .to_socket_addrs()
            .map_err(|error| unreachable(name, &error.to_string()))?;
        let mut reason = "its host has no address".to_owned();
        for address in addresses {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(_) => return Ok(()),
                Err(error) => reason = error.to_string(),
            }
        }
        Err(unreachable(name, &reason))
    }

    fn unreachable(name: &str, reason: &str) -> NoDisplay {
        NoDisplay::Unreachable {
            name: name.to_owned(),
            reason: reason.to_owned(),
        }
    }
}

#[cfg(all(test, unix, not(target_os = "macos")))]
mod tests {
    use super::*;

    #[test]
    fn display_names_are_read_as_x11_does() {
        assert_eq!(socket::parse(":0"), Some(("", 0)));
        assert_eq!(socket::parse(":10.0"), Some(("", 10)));
        assert_eq!(socket::parse("localhost:10.0"), Some(("localhost", 10)));
        assert_eq!(socket::parse("::1:7"), Some(("::1", 7)));
        assert_eq!(socket::parse("nonsense"), None);
        assert_eq!(socket::parse(":zero"), None);
    }

    #[test]
    fn a_display_that_does_not_exist_is_named_in_the_reason() {
        for name in [":54321", "nonsense", "/no/such/socket:0"] {
            let reason = socket::reach_x11(name)
                .expect_err("nobody listens there")
                .to_string();
            assert!(reason.contains(name), "{reason}");
        }
        assert!(socket::reach_wayland("wayland-54321", "/no/such/folder").is_err());
    }
}
