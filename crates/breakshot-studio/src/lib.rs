//! `breakshot studio`: the browser interface, from this machine to this machine.
//!
//! A page from 127.0.0.1 shows the files of one folder and runs the library on them. What it shows and writes is what the commands show and
//! write; it contains no physics. Nothing in it can move an arm: it links no driver.
//!
//! | module | question |
//! |---|---|
//! | `http` | who may ask, and how much? |
//! | `project` | which files of the folder are there, and which are not of the folder? |
//! | `pile` | what does a strike do to this pile? where may an object be put? which strike is planned? |
//! | `cell` | where does the camera see the tags, and where does the cell give them? |
//! | `compare` | how does a filmed strike compare with its simulation? |
//! | `films` | what do the films show, and what was found in them? |
//! | `robot` | what would the arm do for a strike? |
//! | `jobs` | what takes longer, how far is it, is it to end? |
//! | `studio` | which question goes where? |
//! | `templates` | how does an empty folder become a project? |
//! | `assets` | the page itself |

mod assets;
mod cell;
mod compare;
mod films;
mod http;
mod jobs;
mod pile;
mod project;
mod robot;
mod studio;
mod templates;

use breakshot::{Error, Result};
use http::gate::Gate;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::Path;
use std::sync::Arc;

/// Entry points of the fuzz targets.
#[cfg(feature = "fuzzing")]
#[doc(hidden)]
pub mod fuzzing {
    /// The status with which the head of a request is refused; `None` if it is accepted.
    pub fn request(head: &[u8]) -> Option<u16> {
        crate::http::request::refusal(head)
    }
}

/// The server of the page, bound to a port of this machine.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    gate: Arc<Gate>,
    studio: Arc<studio::Studio>,
}

impl Server {
    /// Binds to a port of 127.0.0.1, a free one for port 0. `templates` are the files (name and text) with which an empty folder begins.
    ///
    /// # Errors
    /// A folder that does not exist, a port that is in use.
    pub fn bind(
        folder: &Path,
        port: u16,
        templates: &'static [(&'static str, &'static str)],
    ) -> Result<Self> {
        let studio = Arc::new(studio::Studio::open(folder, templates)?);
        let unusable = |source| Error::Write { path: format!("127.0.0.1:{port}").into(), source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(unusable)?;
        let address = listener.local_addr().map_err(unusable)?;
        let gate = Arc::new(Gate::new(address.port()).map_err(unusable)?);
        Ok(Self { listener, address, gate, studio })
    }

    /// The address at which it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The link that opens the page, once. The token is behind `#`: browsers do not send that part to any server.
    pub fn link(&self) -> String {
        format!("http://{}/#{}", self.address, self.gate.token().unwrap_or_default())
    }

    /// Answers until the program ends.
    ///
    /// # Errors
    /// A system that starts no threads.
    pub fn serve(&self) -> Result<()> {
        let failed = |source| Error::Write { path: self.address.to_string().into(), source };
        http::server::serve(&self.listener, &self.gate, &self.studio).map_err(failed)
    }
}
