//! Checks whether a window can be opened, before Bevy tries to.
//!
//! Bevy panics without a display or a graphics adapter; [`check`] returns the reason in one
//! sentence instead. It opens no window and keeps nothing but [`Reached`].

use bevy::tasks::block_on;

/// Reason why no window can be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoDisplay {
    /// Neither an X11 nor a Wayland display is named.
    #[error("no display: neither DISPLAY nor WAYLAND_DISPLAY is set")]
    NotNamed,
    /// A display is named, but cannot be connected to.
    #[error("cannot connect to the display {name}: {reason}")]
    Unreachable {
        /// Value of the environment variable.
        name: String,
        /// Message of the system.
        reason: String,
    },
    /// There is a display but no graphics adapter.
    #[error("no graphics adapter: none of Vulkan, Metal, Direct3D 12 and OpenGL offers one")]
    NoAdapter,
    /// The window system or the graphics driver failed when the window was opened.
    #[error("cannot open the window: {0}")]
    Refused(String),
}

/// Connection to a display, to be kept until the window is open. The search for an adapter connects
/// to the display and disconnects again; an X server resets itself when its last client
/// disconnects, and would then refuse the window.
#[derive(Debug)]
#[must_use = "the display may reset itself when this is dropped"]
pub struct Reached {
    #[cfg(all(unix, not(target_os = "macos")))]
    _connection: server::Connection,
}

/// Checks that there is a display and a graphics adapter.
///
/// # Errors
/// The first of the two that is missing.
pub fn check() -> Result<Reached, NoDisplay> {
    let reached = reach_display()?;
    check_adapter()?;
    Ok(reached)
}

/// Checks that there is a graphics adapter. This is sufficient for rendering to a file.
///
/// # Errors
/// [`NoDisplay::NoAdapter`].
pub fn check_adapter() -> Result<(), NoDisplay> {
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapters = block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    if adapters.is_empty() {
        return Err(NoDisplay::NoAdapter);
    }
    Ok(())
}

/// Windows and macOS always have a display.
#[cfg(not(all(unix, not(target_os = "macos"))))]
fn reach_display() -> Result<Reached, NoDisplay> {
    Ok(Reached {})
}

#[cfg(all(unix, not(target_os = "macos")))]
fn reach_display() -> Result<Reached, NoDisplay> {
    let named = |variable| std::env::var(variable).ok().filter(|name| !name.is_empty());
    let wayland = named("WAYLAND_DISPLAY").map(|name| server::reach_wayland(&name));
    let x11 = named("DISPLAY").map(|name| server::reach_x11(&name));
    let connection = match (wayland, x11) {
        (Some(Ok(connection)), _) | (_, Some(Ok(connection))) => connection,
        (_, Some(Err(error))) | (Some(Err(error)), None) => return Err(error),
        (None, None) => return Err(NoDisplay::NotNamed),
    };
    Ok(Reached {
        _connection: connection,
    })
}

/// Connections to display servers.
#[cfg(all(unix, not(target_os = "macos")))]
mod server {
    use super::NoDisplay;
    use std::{env, os::unix::net::UnixStream, path::PathBuf};
    use x11rb::rust_connection::RustConnection;

    /// An open connection, kept only to be closed.
    #[derive(Debug)]
    pub(in crate::sandbox) enum Connection {
        Wayland { _stream: UnixStream },
        X11 { _connection: Box<RustConnection> },
    }

    pub(in crate::sandbox) fn reach_wayland(name: &str) -> Result<Connection, NoDisplay> {
        // The name is a socket in the user's runtime folder, or an absolute path.
        let folder = env::var_os("XDG_RUNTIME_DIR").map_or_else(PathBuf::new, PathBuf::from);
        let stream =
            UnixStream::connect(folder.join(name)).map_err(|error| unreachable(name, &error))?;
        Ok(Connection::Wayland { _stream: stream })
    }

    pub(in crate::sandbox) fn reach_x11(name: &str) -> Result<Connection, NoDisplay> {
        let (connection, _) =
            RustConnection::connect(Some(name)).map_err(|error| unreachable(name, &error))?;
        Ok(Connection::X11 {
            _connection: Box::new(connection),
        })
    }

    fn unreachable(name: &str, error: &dyn std::error::Error) -> NoDisplay {
        NoDisplay::Unreachable {
            name: name.to_owned(),
            reason: error.to_string(),
        }
    }
}

#[cfg(all(test, unix, not(target_os = "macos")))]
mod tests {
    use super::*;

    #[test]
    fn a_display_that_does_not_exist_is_named_in_the_reason() {
        for name in [":54321", "nonsense", "/no/such/socket:0"] {
            let reason = server::reach_x11(name)
                .expect_err("the connection is refused")
                .to_string();
            assert!(reason.contains(name), "{reason}");
        }
        assert!(server::reach_wayland("wayland-54321").is_err());
    }
}
