//! Entry points of the fuzz targets (feature `fuzzing`): any bytes as the messages of a robot, without a network.

use crate::robot::arm::Stop;
use crate::robot::indy::Indy;
use crate::robot::rosbridge;
use breakshot::robot::Command;
use http_body_util::Full;
use std::convert::Infallible;
use std::future::{Ready, ready};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use tonic::body::Body;
use tonic::codegen::{Bytes, Service, http};

/// Receives messages of a rosbridge, one a line, while the strike of a command is under way.
///
/// # Errors
/// In words, what the driver must not derive from any messages.
pub fn rosbridge(command: &Command, messages: &str) -> Result<(), String> {
    rosbridge::fuzzing::received(command, messages)
}

/// Asks a controller all that a strike asks, but its motions, and gives these answers: for each its length (two bytes, little-endian) and
/// its bytes; a length of 65,535 is an error of the controller. When they are used up, answers are empty.
///
/// # Errors
/// A runtime that cannot be started; the driver's own errors are expected.
pub fn indy(command: &Command, answers: &[u8]) -> Result<(), String> {
    let runtime = tokio::runtime::Builder::new_current_thread().build().map_err(|e| e.to_string())?;
    let answers = Answers { rest: Arc::new(Mutex::new(answers.to_vec())) };
    let channel = || answers.clone();
    let indy = Indy::over([channel(), channel()], channel(), channel(), channel(), true);
    runtime.block_on(async {
        // Whatever the answers are, the driver ends with values or with errors: which ones is not in question here.
        drop(indy.preflight(command).await);
        drop(indy.state().await);
        drop(indy.reading().await);
        drop(indy.explanation().await);
        drop(indy.stop(Stop::Smooth).await);
    });
    Ok(())
}

/// A controller that answers every request with the next bytes.
#[derive(Clone)]
struct Answers {
    rest: Arc<Mutex<Vec<u8>>>,
}

impl Answers {
    /// The next answer; `None` for an error.
    fn next(&self) -> Option<Vec<u8>> {
        let mut rest = self.rest.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((length, _)) = rest.split_first_chunk() else { return Some(Vec::new()) };
        let length = u16::from_le_bytes(*length);
        let end = rest.len().min(2 + usize::from(length));
        let answer = rest[2..end].to_vec();
        rest.drain(..end);
        (length < u16::MAX).then_some(answer)
    }
}

impl Service<http::Request<Body>> for Answers {
    type Response = http::Response<Body>;
    type Error = Infallible;
    type Future = Ready<Result<Self::Response, Infallible>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, _: http::Request<Body>) -> Self::Future {
        /// `UNAVAILABLE`.
        const FAILURE: u16 = 14;
        let answer = self.next();
        let status = if answer.is_some() { 0 } else { FAILURE };
        let message = answer.unwrap_or_default();
        // A gRPC message: not compressed, its length, its bytes.
        let length = u32::try_from(message.len()).unwrap_or(u32::MAX).to_be_bytes();
        let framed = [&[0], &length[..], &message].concat();
        let mut response = http::Response::new(Body::new(Full::new(Bytes::from(framed))));
        let headers = response.headers_mut();
        headers.insert("content-type", http::HeaderValue::from_static("application/grpc"));
        headers.insert("grpc-status", http::HeaderValue::from(status));
        ready(Ok(response))
    }
}
