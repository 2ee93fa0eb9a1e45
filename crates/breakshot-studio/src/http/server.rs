//! Accepts connections, a bounded number of them, and answers their requests.

use super::gate::{Gate, SESSION_PATH};
use super::limits::{LINGER_TIME, MOST_CONNECTIONS, MOST_LINGERED_READS, WRITE_TIME};
use super::request::{Method, NoRequest, Reader, Request};
use super::response::{Answer, Response, event_stream_head};
use crate::assets;
use crate::studio::Studio;
use std::io::{Read, Result, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A connection that is open.
struct Open {
    number: u64,
    stream: TcpStream,
    /// Whether it has shown the cookie.
    is_known: bool,
}

/// The connections that are open, the oldest first.
#[derive(Clone, Default)]
struct Connections(Arc<Mutex<Vec<Open>>>);

impl Connections {
    fn with<T>(&self, act: impl FnOnce(&mut Vec<Open>) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Adds a connection; the oldest unknown one is closed if there are too many. False if all are known.
    fn add(&self, number: u64, stream: TcpStream) -> bool {
        self.with(|open| {
            if open.len() >= MOST_CONNECTIONS {
                let Some(oldest) = open.iter().position(|one| !one.is_known) else { return false };
                let _ = open.remove(oldest).stream.shutdown(Shutdown::Both);
            }
            open.push(Open { number, stream, is_known: false });
            true
        })
    }

    fn mark_known(&self, number: u64) {
        self.with(|open| open.iter_mut().filter(|o| o.number == number).for_each(|o| o.is_known = true));
    }

    fn remove(&self, number: u64) {
        self.with(|open| open.retain(|one| one.number != number));
    }
}

/// The place of a connection; it is free again also if an answer fails.
struct Place<'a> {
    connections: &'a Connections,
    number: u64,
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.connections.remove(self.number);
    }
}

/// Answers until the program ends.
///
/// # Errors
/// No thread can be started.
pub(crate) fn serve(listener: &TcpListener, gate: &Arc<Gate>, studio: &Arc<Studio>) -> Result<()> {
    let connections = Connections::default();
    let mut number = 0;
    loop {
        let Ok((stream, _)) = listener.accept() else {
            // Out of descriptors: some are free again in a moment.
            std::thread::sleep(Duration::from_millis(10));
            continue;
        };
        number += 1;
        let Ok(handle) = stream.try_clone() else { continue };
        if !connections.add(number, handle) {
            continue;
        }
        let (own, gate, studio) = (connections.clone(), gate.clone(), studio.clone());
        let started = std::thread::Builder::new().stack_size(1 << 20).spawn(move || {
            let _place = Place { connections: &own, number };
            let mut connection = Connection { number, stream, gate: &gate, connections: &own };
            let _ = connection.converse(&studio);
        });
        if started.is_err() {
            connections.remove(number);
        }
    }
}

/// One connection.
struct Connection<'a> {
    number: u64,
    stream: TcpStream,
    gate: &'a Gate,
    connections: &'a Connections,
}

impl Connection<'_> {
    /// Answers one request after the other, until one is refused or the last.
    fn converse(&mut self, studio: &Studio) -> Result<()> {
        self.stream.set_write_timeout(Some(WRITE_TIME))?;
        self.stream.set_nodelay(true)?;
        let mut reader = Reader::new(self.stream.try_clone()?);
        loop {
            let request = match reader.next() {
                Ok(request) => request,
                Err(NoRequest::Ended) => return Ok(()),
                Err(NoRequest::Refused(response)) => {
                    response.write(&mut self.stream, true)?;
                    return self.linger();
                }
            };
            if let Some(length) = request.film_bytes {
                let answer = self.received(&request, length, &mut reader, studio);
                if let Some(response) = answer {
                    response.write(&mut self.stream, true)?;
                }
                return self.linger();
            }
            let is_last = request.is_last();
            match self.answer(&request, studio) {
                Answer::Once(response) => response.write(&mut self.stream, is_last)?,
                Answer::Events(events) => return self.stream_events(&events),
            }
            if is_last {
                return self.stream.shutdown(Shutdown::Both);
            }
        }
    }

    /// Ends the connection after a refusal; what still arrives is read for a moment, so that the refusal is not lost.
    fn linger(&mut self) -> Result<()> {
        self.stream.shutdown(Shutdown::Write)?;
        self.stream.set_read_timeout(Some(LINGER_TIME))?;
        let mut bytes = [0; 8192];
        for _ in 0..MOST_LINGERED_READS {
            if self.stream.read(&mut bytes)? == 0 {
                break;
            }
        }
        self.stream.shutdown(Shutdown::Both)
    }

    /// The answer to a film that arrives; none where the connection has ended.
    fn received(
        &self,
        request: &Request,
        length: u64,
        reader: &mut Reader,
        studio: &Studio,
    ) -> Option<Response> {
        if let Err(refusal) = self.gate.check_names(request) {
            return Some(refusal);
        }
        if !self.gate.knows(request) {
            return Some(Response::refusal(401, "open the link that the program printed"));
        }
        self.connections.mark_known(self.number);
        match studio.add_film(request, &mut |file| reader.copy(length, file)) {
            Ok(response) | Err(NoRequest::Refused(response)) => Some(response),
            Err(NoRequest::Ended) => None,
        }
    }

    fn answer(&self, request: &Request, studio: &Studio) -> Answer {
        if let Err(refusal) = self.gate.check_names(request) {
            return refusal.into();
        }
        if request.method == Method::Get
            && let Some(page) = assets::page(&request.path)
        {
            return page.into();
        }
        if request.method == Method::Post && request.path == SESSION_PATH {
            return self.gate.opened(request).into();
        }
        if !self.gate.knows(request) {
            return Response::refusal(401, "open the link that the program printed").into();
        }
        self.connections.mark_known(self.number);
        studio.answer(request)
    }

    /// Sends events until there are no more; a comment now and then finds out whether the page is still there.
    fn stream_events(&mut self, events: &Receiver<String>) -> Result<()> {
        use std::sync::mpsc::RecvTimeoutError;
        self.stream.write_all(event_stream_head().as_bytes())?;
        loop {
            match events.recv_timeout(Duration::from_secs(5)) {
                Ok(event) => self.stream.write_all(format!("data: {event}\n\n").as_bytes())?,
                Err(RecvTimeoutError::Timeout) => self.stream.write_all(b": \n\n")?,
                Err(RecvTimeoutError::Disconnected) => return self.stream.shutdown(Shutdown::Both),
            }
        }
    }
}
