//! Who may ask: the token, the Host, the Origin, and the header that only a script of this page
//! can set.
//!
//! The address that is printed holds a token that opens the page once: it stands in the terminal, in
//! the list of processes while the browser is started, and in the browser's history. What the browser
//! gets for it, and sends from then on, stands nowhere else.

use std::net::{IpAddr, SocketAddr};
use std::sync::{Mutex, PoisonError};

use axum::http::header::{COOKIE, HOST, LOCATION, ORIGIN, SET_COOKIE};
use axum::http::{HeaderMap, HeaderName, Method, Request, StatusCode};
use axum::response::Response;
use rand::TryRng;
use rand::rngs::SysRng;

use super::answer;
use super::refusal::{Refusal, Result};

/// Also sent by programs that have no cookies.
const TOKEN_HEADER: HeaderName = HeaderName::from_static("x-muybridge-token");

/// A form or a picture on a foreign page cannot send it.
const WRITE_HEADER: HeaderName = HeaderName::from_static("x-muybridge");

/// 256 bits.
const TOKEN_BYTES: usize = 32;

/// Addresses that were given out and not opened, the oldest of which is forgotten for another.
const MOST_INVITATIONS: usize = 4;

/// Checks requests before anything is done.
pub(super) struct Guard {
    /// What every request carries, for as long as the studio runs.
    token: String,
    /// Tokens that open the page, each once.
    invitations: Mutex<Vec<String>>,
    address: SocketAddr,
}

/// What becomes of a request.
pub(super) enum Passage {
    /// It is answered.
    Open,
    /// It opens the page with the token: the cookie is set and the token leaves the address.
    Enter(Response),
}

impl Guard {
    /// A guard with a new token from the operating system.
    pub(super) fn new(address: SocketAddr) -> std::io::Result<Self> {
        Ok(Self { token: new_token()?, invitations: Mutex::default(), address })
    }

    /// An address to open in a browser, once.
    pub(super) fn invitation(&self) -> std::io::Result<String> {
        let token = new_token()?;
        let host = match self.address.ip() {
            ip if ip.is_unspecified() => format!("127.0.0.1:{}", self.address.port()),
            _ => self.address.to_string(),
        };
        let url = format!("http://{host}/?token={token}");
        let mut open = self.invitations.lock().unwrap_or_else(PoisonError::into_inner);
        open.push(token);
        let forgotten = open.len().saturating_sub(MOST_INVITATIONS);
        open.drain(..forgotten);
        Ok(url)
    }

    /// Takes an invitation; whether there was one.
    fn take_invitation(&self, given: &str) -> bool {
        let mut open = self.invitations.lock().unwrap_or_else(PoisonError::into_inner);
        let before = open.len();
        open.retain(|token| !is_same(token, given));
        open.len() < before
    }

    /// Looks at everything but the body.
    pub(super) fn check<B>(&self, request: &Request<B>) -> Result<Passage> {
        let host = self.host(request.headers())?;
        // The request line may name a server, too.
        if request.uri().authority().is_some_and(|named| named.as_str() != host) {
            return Err(Refusal::forbidden("this server is not known by that name"));
        }
        let method = request.method();
        let writes = match *method {
            Method::GET | Method::HEAD => false,
            Method::POST | Method::PUT | Method::PATCH | Method::DELETE => true,
            _ => {
                let sentence = "this method is not used here";
                return Err(Refusal::new(StatusCode::METHOD_NOT_ALLOWED, sentence));
            }
        };
        if let Some(origin) = request.headers().get(ORIGIN)
            && origin.as_bytes() != format!("http://{host}").as_bytes()
        {
            return Err(Refusal::forbidden("requests from other pages are not answered"));
        }
        let opening = (*method == Method::GET && request.uri().path() == "/")
            .then(|| request.uri().query().and_then(token_of_query))
            .flatten();
        if let Some(given) = opening {
            // Opened again in the same browser, a used address still leads to the page.
            return match self.take_invitation(given) || self.has_token(request.headers()) {
                true => Ok(Passage::Enter(self.entrance())),
                false => Err(used()),
            };
        }
        if !self.has_token(request.headers()) {
            return Err(no_token());
        }
        let marked = request.headers().get(WRITE_HEADER).is_some_and(|v| v.as_bytes() == b"1");
        if writes && !marked {
            return Err(Refusal::forbidden(
                "a request that changes something needs the header X-Muybridge: 1",
            ));
        }
        Ok(Passage::Open)
    }

    /// The Host, when it is this server by its own address: a name that merely points here may be
    /// that of a hostile page.
    fn host<'a>(&self, headers: &'a HeaderMap) -> Result<&'a str> {
        let refused = || Refusal::forbidden("this server is not known by that name");
        let mut hosts = headers.get_all(HOST).iter();
        let (Some(host), None) = (hosts.next(), hosts.next()) else { return Err(refused()) };
        let host = host.to_str().map_err(|_| refused())?;
        let port = self.address.port();
        let (name, given) = host.rsplit_once(':').unwrap_or((host, "80"));
        if given != port.to_string() {
            return Err(refused());
        }
        let literal = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>().ok();
        let bound = self.address.ip();
        let known = match literal {
            Some(ip) if bound.is_unspecified() || bound.is_loopback() => {
                bound.is_unspecified() || ip.is_loopback()
            }
            Some(ip) => ip == bound,
            None => name == "localhost" && (bound.is_loopback() || bound.is_unspecified()),
        };
        if known { Ok(host) } else { Err(refused()) }
    }

    /// Cookies are not told apart by port, so the port is part of the name: two studios can be open.
    fn cookie_name(&self) -> String {
        format!("muybridge_token_{}", self.address.port())
    }

    fn entrance(&self) -> Response {
        let mut response = answer::empty(StatusCode::SEE_OTHER);
        let cookie =
            format!("{}={}; Path=/; HttpOnly; SameSite=Strict", self.cookie_name(), self.token);
        answer::header(&mut response, SET_COOKIE, &cookie);
        answer::header(&mut response, LOCATION, "/");
        response
    }

    fn has_token(&self, headers: &HeaderMap) -> bool {
        if headers.get(TOKEN_HEADER).and_then(|v| v.to_str().ok()).is_some_and(|t| self.is_token(t))
        {
            return true;
        }
        let name = self.cookie_name();
        headers
            .get_all(COOKIE)
            .iter()
            .filter_map(|v| v.to_str().ok())
            .flat_map(|cookies| cookies.split(';'))
            .filter_map(|cookie| cookie.trim().split_once('='))
            .any(|(n, value)| n == name && self.is_token(value))
    }

    fn is_token(&self, given: &str) -> bool {
        is_same(&self.token, given)
    }
}

/// In a time that does not depend on where the two differ.
fn is_same(own: &str, given: &str) -> bool {
    let (own, given) = (own.as_bytes(), given.as_bytes());
    let differ = own.iter().zip(given).fold(0, |all, (a, b)| all | (a ^ b));
    own.len() == given.len() && std::hint::black_box(differ) == 0
}

fn new_token() -> std::io::Result<String> {
    let mut bytes = [0_u8; TOKEN_BYTES];
    SysRng.try_fill_bytes(&mut bytes).map_err(std::io::Error::other)?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

fn token_of_query(query: &str) -> Option<&str> {
    query.split('&').find_map(|part| part.strip_prefix("token="))
}

fn no_token() -> Refusal {
    let refusal = Refusal::new(StatusCode::UNAUTHORIZED, "the token is missing or wrong");
    let hint = "open the address that `muybridge studio` printed".to_owned();
    Refusal { hint: Some(hint), ..refusal }
}

fn used() -> Refusal {
    let sentence = "this address is wrong, or was opened before: it opens the studio once";
    let hint = "the open page gives another («Another browser»), and so does starting it again";
    Refusal { hint: Some(hint.to_owned()), ..Refusal::new(StatusCode::UNAUTHORIZED, sentence) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(address: &str) -> Guard {
        Guard::new(address.parse().unwrap()).unwrap()
    }

    fn host(guard: &Guard, host: &'static str) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(HOST, host.parse().unwrap());
        guard.host(&headers).is_ok()
    }

    #[test]
    fn tokens_are_long_differ_and_are_compared_whole() {
        let (a, b) = (guard("127.0.0.1:80"), guard("127.0.0.1:80"));
        assert_eq!(a.token.len(), 64);
        assert_ne!(a.token, b.token);
        assert!(a.is_token(&a.token) && !a.is_token(&b.token));
        assert!(
            !a.is_token("") && !a.is_token(&a.token[1..]) && !a.is_token(&format!("{}0", a.token))
        );
    }

    #[test]
    fn only_the_servers_own_addresses_are_hosts() {
        let loopback = guard("127.0.0.1:8000");
        for own in ["127.0.0.1:8000", "localhost:8000", "[::1]:8000"] {
            assert!(host(&loopback, own), "{own}");
        }
        for foreign in
            ["evil.example:8000", "127.0.0.1:8001", "127.0.0.1", "10.0.0.1:8000", "", ":8000"]
        {
            assert!(!host(&loopback, foreign), "{foreign}");
        }
        let open = guard("0.0.0.0:8000");
        assert!(host(&open, "192.168.1.7:8000") && !host(&open, "evil.example:8000"));
        let one = guard("192.168.1.7:8000");
        assert!(host(&one, "192.168.1.7:8000") && !host(&one, "127.0.0.1:8000"));
        assert!(!host(&one, "localhost:8000"));
    }
}
