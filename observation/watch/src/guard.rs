//! What every request has to pass: it means this page by name, comes from this page where it changes something, and from somebody who is
//! logged in where that is asked for.
//!
//! A page of somebody else, open in the same browser, can send requests to an address of this machine. It cannot do so under a name that
//! is an address or `localhost` and yet read the answer (names that change their address are refused), and what it posts carries its own
//! origin (which is refused).

use std::net::IpAddr;
use std::sync::Arc;
use std::time::Instant;

use axum::extract::{Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, HOST, LOCATION, ORIGIN, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::assets::BEFORE_LOGIN;
use crate::error::Problem;
use understudy_wire::Role;

use crate::login::{Logins, Person};

/// Who is let in.
#[derive(Debug)]
pub(crate) struct Gate {
    pub(crate) logins: Option<Logins>,
    /// Names of the page besides its addresses.
    pub(crate) names: Vec<String>,
    /// The person of a page without logins.
    pub(crate) person: Option<String>,
}

/// Pictures of ladders set their own lengths and fonts, so inline styles are allowed; inline scripts are not.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'; form-action 'self'; base-uri 'none'";

pub(crate) async fn guard(
    State(gate): State<Arc<Gate>>,
    mut request: Request,
    next: Next,
) -> Response {
    let path = request.uri().path().to_owned();
    let answered = match admit(&gate, &request) {
        Ok(person) => {
            request.extensions_mut().insert(person);
            next.run(request).await
        }
        Err(Refused::NotLoggedIn) if path == "/" => {
            (StatusCode::SEE_OTHER, [(LOCATION, "/login.html")]).into_response()
        }
        Err(Refused::NotLoggedIn) => {
            Problem::log_in("log in first: this page is not for everybody").into_response()
        }
        Err(Refused::Foreign(why)) => Problem::foreign(why).into_response(),
    };
    harden(answered, path.starts_with("/api/"))
}

enum Refused {
    NotLoggedIn,
    Foreign(String),
}

fn admit(gate: &Gate, request: &Request) -> Result<Person, Refused> {
    let headers = request.headers();
    let host = headers.get(HOST).and_then(|host| host.to_str().ok());
    // Without a name there is nothing that could be confused; only HTTP/1.0 leaves it away.
    let host = host.ok_or_else(|| Refused::Foreign("the request does not say its host".into()))?;
    if !gate.names.iter().any(|name| name == name_of(host)) && !is_own_name(name_of(host)) {
        return Err(Refused::Foreign(format!(
            "this page is not known as {host:.80}: use its address, or serve it with --known-as"
        )));
    }
    if request.method() != Method::GET && request.method() != Method::HEAD {
        from_this_page(headers, host, gate.logins.is_some()).map_err(Refused::Foreign)?;
    }
    let path = request.uri().path();
    match &gate.logins {
        // The loopback interface is reached from this machine only.
        None => {
            let name = gate.person.clone().unwrap_or_default();
            Ok(Person { name, role: Role::Engineer })
        }
        Some(logins) => match logins.person(headers, Instant::now()) {
            Some(person) => Ok(person),
            None if path == "/api/login" || BEFORE_LOGIN.contains(&path) => {
                Ok(Person { name: String::new(), role: Role::Viewer })
            }
            None => Err(Refused::NotLoggedIn),
        },
    }
}

/// The host without its port.
fn name_of(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    }
}

/// An address cannot be made to mean another machine; a name can.
fn is_own_name(name: &str) -> bool {
    let bare = name.trim_start_matches('[').trim_end_matches(']');
    name.eq_ignore_ascii_case("localhost") || bare.parse::<IpAddr>().is_ok()
}

fn from_this_page(headers: &HeaderMap, host: &str, secure: bool) -> Result<(), String> {
    let text = |value: &HeaderValue| value.to_str().unwrap_or("?").to_owned();
    if let Some(site) = headers.get("sec-fetch-site").map(text)
        && site != "same-origin"
    {
        return Err(format!("the request comes from another site ({site:.40})"));
    }
    let scheme = if secure { "https" } else { "http" };
    match headers.get(ORIGIN).map(text) {
        Some(origin) if origin == format!("{scheme}://{host}") => Ok(()),
        Some(origin) => Err(format!("the request comes from {origin:.80}")),
        // A program that is no browser: it shows that it means this.
        None if headers.contains_key("x-understudy") => Ok(()),
        None => Err("the request does not say where it comes from".to_owned()),
    }
}

fn harden(mut response: Response, private: bool) -> Response {
    let headers = response.headers_mut();
    let fixed = HeaderValue::from_static;
    headers.insert(CONTENT_SECURITY_POLICY, fixed(POLICY));
    headers.insert(X_CONTENT_TYPE_OPTIONS, fixed("nosniff"));
    headers.insert(X_FRAME_OPTIONS, fixed("DENY"));
    headers.insert(REFERRER_POLICY, fixed("no-referrer"));
    if private {
        headers.insert(CACHE_CONTROL, fixed("no-store"));
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_names_of_this_page_and_other_names_are_not() {
        let check = |host: &str, expected| {
            assert_eq!(is_own_name(name_of(host)), expected, "{host}");
        };
        check("localhost", true);
        check("localhost:7480", true);
        check("127.0.0.1:7480", true);
        check("[::1]:7480", true);
        check("192.168.0.7", true);
        check("evil.example", false);
        check("evil.example:7480", false);
        check("127.0.0.1.evil.example", false);
        check("", false);
        check(":80", false);
    }

    #[test]
    fn what_changes_something_comes_from_this_page() {
        let check = |lines: &[(&'static str, &str)], expected: bool| {
            let mut headers = HeaderMap::new();
            for (name, value) in lines {
                headers.insert(*name, value.parse().expect("a header"));
            }
            let found = from_this_page(&headers, "localhost:1", false).is_ok();
            assert_eq!(found, expected, "{lines:?}");
        };
        check(&[("origin", "http://localhost:1")], true);
        check(&[("origin", "http://localhost:2")], false);
        check(&[("origin", "https://localhost:1")], false);
        check(&[("origin", "null")], false);
        check(&[], false);
        check(&[("x-understudy", "1")], true);
        check(&[("x-understudy", "1"), ("sec-fetch-site", "cross-site")], false);
        check(&[("origin", "http://localhost:1"), ("sec-fetch-site", "same-origin")], true);
    }
}
