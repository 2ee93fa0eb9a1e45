//! Who may ask?
//!
//! The program prints a link with a token that can be used once. The page sends it in the body of a POST and gets a cookie, which scripts
//! cannot read and which other sites cannot make the browser send. Host and Origin are compared with this server's own names, so that
//! neither another site nor a name that resolves to this machine reaches it.

use super::request::{Method, Request};
use super::response::Response;
use std::sync::{Mutex, PoisonError};

/// The path at which a token becomes a cookie.
pub(crate) const SESSION_PATH: &str = "/session";

/// What a request must show.
pub(crate) struct Gate {
    port: u16,
    /// The token of the printed link, until it is used.
    token: Mutex<Option<String>>,
    /// The content of the cookie.
    key: String,
}

impl Gate {
    /// # Errors
    /// The system gives no random numbers.
    pub(crate) fn new(port: u16) -> std::io::Result<Self> {
        Ok(Self { port, token: Mutex::new(Some(secret()?)), key: secret()? })
    }

    /// The token of the printed link; none after it was used.
    pub(crate) fn token(&self) -> Option<String> {
        self.token.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Checks the name under which the server is asked, and the page that asks.
    ///
    /// # Errors
    /// The refusal.
    pub(crate) fn check_names(&self, request: &Request) -> Result<(), Response> {
        let hosts = ["127.0.0.1", "localhost"].map(|host| format!("{host}:{}", self.port));
        let Some(host) = request.header("host").filter(|host| hosts.iter().any(|known| known == host)) else {
            return Err(Response::refusal(403, "this is not the name of this server"));
        };
        let own = format!("http://{host}");
        let is_own = match request.header("origin") {
            Some(origin) => origin == own,
            None => request.method == Method::Get,
        };
        let site = request.header("sec-fetch-site");
        let is_elsewhere = site.is_some_and(|site| site != "same-origin" && site != "none");
        // A link may lead to the page from anywhere: the page by itself holds no data and changes nothing.
        let is_link = request.path == "/" && request.header("sec-fetch-mode") == Some("navigate");
        if !is_own || (is_elsewhere && !is_link) {
            return Err(Response::refusal(403, "another page may not ask this server"));
        }
        // Neither can be sent by a form of another site.
        let (kind, words) = match request.film_bytes {
            Some(_) => ("application/octet-stream", "a film is sent as bytes"),
            None => ("application/json", "a body is JSON"),
        };
        if request.method == Method::Post && request.header("content-type") != Some(kind) {
            return Err(Response::refusal(415, words));
        }
        Ok(())
    }

    /// Exchanges the token for a cookie, once.
    pub(crate) fn opened(&self, request: &Request) -> Response {
        #[derive(serde::Deserialize)]
        struct Given {
            token: String,
        }
        let given =
            serde_json::from_slice::<Given>(&request.body).map(|given| given.token).unwrap_or_default();
        let mut token = self.token.lock().unwrap_or_else(PoisonError::into_inner);
        if !token.as_ref().is_some_and(|token| are_equal(token, &given)) {
            let reason = "the link was used before, or is not the one that the program printed";
            return Response::refusal(403, reason);
        }
        *token = None;
        let cookie = format!("{}={}; HttpOnly; SameSite=Strict; Path=/", self.cookie_name(), self.key);
        Response::json(&serde_json::json!({ "open": true })).with("Set-Cookie", cookie)
    }

    /// Whether the request shows the cookie.
    pub(crate) fn knows(&self, request: &Request) -> bool {
        let name = self.cookie_name();
        let cookies = request.header("cookie").unwrap_or_default().split(';');
        let mut values =
            cookies.filter_map(|cookie| cookie.trim().split_once('=')).filter(|(n, _)| *n == name);
        values.any(|(_, value)| are_equal(&self.key, value))
    }

    /// Cookies do not distinguish ports: the name does.
    fn cookie_name(&self) -> String {
        format!("breakshot-{}", self.port)
    }
}

/// 32 random bytes in hexadecimal digits.
fn secret() -> std::io::Result<String> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
    let digit = |half: u8| char::from(b"0123456789abcdef"[usize::from(half)]);
    Ok(bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect())
}

/// Compares in a time that does not depend on where two texts differ.
fn are_equal(one: &str, other: &str) -> bool {
    let differences = one.bytes().zip(other.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b));
    one.len() == other.len() && std::hint::black_box(differences) == 0
}
