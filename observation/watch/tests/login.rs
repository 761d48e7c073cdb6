//! The page for other machines: over TLS only, and only to those who show a token.

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::spawn;
use std::time::Duration;

use rustls::pki_types::ServerName;
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use understudy_journal::{Commander, Done, OperatorAction};
use understudy_watch::{
    Certificate, Commanding, Logins, Place, Served, Settings, WatchError, serve,
};

const OPERATOR: &str = "0123456789abcdef0123456789abcdef";
const VIEWER: &str = "fedcba9876543210fedcba9876543210";

fn looking() -> Commanding {
    Commanding { forbidden: Some("a test looks only".to_owned()), ..commanding() }
}

fn commanding() -> Commanding {
    Commanding {
        commander: Commander::of_run("nothing".into()),
        forbidden: None,
        after_scenario: false,
        impossible: Vec::new(),
        person: None,
    }
}

fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("login").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old run's folder goes");
    }
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn logins_file(folder: &Path, rights: u32) -> PathBuf {
    let path = folder.join("logins.txt");
    let text = format!("operator anna {OPERATOR}\nviewer bert {VIEWER}\n");
    fs::write(&path, text).expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(rights)).expect("rights");
    path
}

/// A page, and what a browser that trusts its certificate is.
struct Page {
    _served: Served,
    address: SocketAddr,
    client: Arc<ClientConfig>,
}

impl Page {
    fn start(folder: &Path) -> Self {
        Self::with(folder, looking())
    }

    fn with(folder: &Path, commanding: Commanding) -> Self {
        let made = rcgen::generate_simple_self_signed(vec!["127.0.0.1".to_owned()]);
        let made = made.expect("a certificate");
        let (chain, key) = (folder.join("page.pem"), folder.join("page.key"));
        fs::write(&chain, made.cert.pem()).expect("written");
        fs::write(&key, made.signing_key.serialize_pem()).expect("written");
        let served = serve(Settings {
            run: folder.join("nothing"),
            commanding,
            place: Place {
                address: "127.0.0.1:0".parse().expect("an address"),
                logins: Some(Logins::of_file(&logins_file(folder, 0o600)).expect("logins")),
                certificate: Some(Certificate { chain, key }),
                names: Vec::new(),
            },
        });
        let served = served.expect("served");
        let url = served.url();
        let address = url.trim_start_matches("https://").trim_end_matches('/');
        let mut roots = RootCertStore::empty();
        roots.add(made.cert.der().clone()).expect("a certificate");
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let client = ClientConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .expect("versions")
            .with_root_certificates(roots)
            .with_no_client_auth();
        Self {
            address: address.parse().expect("an address"),
            client: Arc::new(client),
            _served: served,
        }
    }

    fn ask(&self, method: &str, path: &str, lines: &str, body: &str) -> String {
        let name = ServerName::try_from("127.0.0.1").expect("a name");
        let connection = ClientConnection::new(Arc::clone(&self.client), name).expect("a client");
        let stream = TcpStream::connect(self.address).expect("it listens");
        let patience = Some(Duration::from_secs(60));
        stream.set_read_timeout(patience).expect("a timeout");
        let mut stream = StreamOwned::new(connection, stream);
        let (host, length) = (self.address, body.len());
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: https://{host}\r\n{lines}Content-Type: application/json\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).expect("sent");
        let mut answer = Vec::new();
        // Whoever closes first may leave the goodbye of TLS away.
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8(answer).expect("text")
    }

    fn log_in(&self, token: &str) -> String {
        let body = format!("{{\"token\":\"{token}\"}}");
        self.ask("POST", "/api/login", "", &body)
    }
}

/// The line with which a browser shows its session.
fn cookie(answer: &str) -> String {
    let line = answer
        .lines()
        .find(|line| line.to_lowercase().starts_with("set-cookie: "))
        .expect("a cookie");
    for word in ["HttpOnly", "Secure", "SameSite=Strict"] {
        assert!(line.contains(word), "{line}");
    }
    let pair = line.split([' ', ';']).nth(1).expect("a name and a value");
    format!("Cookie: {pair}\r\n")
}

#[test]
fn only_who_shows_a_token_sees_the_page() {
    let page = Page::start(&empty_folder("token"));
    let status = |answer: &str| answer.split(' ').nth(1).map(str::to_owned);
    let is = |answer: &str, expected: &str| {
        assert_eq!(status(answer).as_deref(), Some(expected), "{answer}");
    };
    is(&page.ask("GET", "/api/run", "", ""), "401");
    is(&page.ask("GET", "/", "", ""), "303");
    is(&page.ask("GET", "/page.js", "", ""), "401");
    is(&page.ask("GET", "/login.html", "", ""), "200");
    is(&page.log_in("a guess"), "401");
    let answer = page.log_in(VIEWER);
    is(&answer, "200");
    let session = cookie(&answer);
    is(&page.ask("GET", "/", &session, ""), "200");
    // Logged in, and the run has not begun.
    let run = page.ask("GET", "/api/run", &session, "");
    is(&run, "404");
    assert!(run.contains("U0683"), "{run}");
    let seen = r#"{"owner":"anna","alarms":[1]}"#;
    let looks_only = page.ask("POST", "/api/alarms/acknowledge", &session, seen);
    is(&looks_only, "403");
    is(&page.ask("POST", "/api/logout", &session, "{}"), "200");
    is(&page.ask("GET", "/api/run", &session, ""), "401");
}

/// Operators write inputs; commands to members need an engineer, and a viewer changes nothing.
#[test]
fn a_role_limits_writes_and_commands() {
    let folder = empty_folder("roles");
    let page = Page::with(&folder, commanding());
    let write = r#"{"command":"write","input":"start","value":"true"}"#;
    let give = |token: &str, command: &str| {
        let session = cookie(&page.log_in(token));
        let body = format!(
            r#"{{"member":"left-io","command":{command},"owner":"anna","reason":"a test"}}"#
        );
        page.ask("POST", "/api/command", &session, &body)
    };
    let is = |answer: String, status: &str, code: &str, text: &str| {
        assert_eq!(answer.split(' ').nth(1), Some(status), "{answer}");
        assert!(answer.contains(code) && answer.contains(text), "{answer}");
    };
    is(give(VIEWER, write), "403", "U0684", "a viewer may not change anything");
    let kill = r#"{"command":"kill"}"#;
    is(give(OPERATOR, kill), "403", "U0684", "only an engineer");
    // Allowed; the run has not begun, so it has no member.
    is(give(OPERATOR, write), "404", "U0681", "left-io");
    let session = cookie(&page.log_in(OPERATOR));
    let short = r#"{"member":"left-io","command":{"command":"write","input":"start"},"owner":"anna","reason":"a test"}"#;
    let answer = page.ask("POST", "/api/command", &session, short);
    is(answer, "400", "U0682", "value");
}

/// The person in the journal is the one that is known; a name in a request counts where none is.
#[test]
fn a_name_in_a_request_counts_only_where_neither_keys_nor_logins_say_one() {
    let folder = empty_folder("persons");
    for (of_keys, is_logged_in, expected) in
        [(None, false, "bob"), (Some("eve"), false, "eve"), (Some("eve"), true, "anna")]
    {
        let (commander, mut commands) = understudy_journal::commands();
        let person = of_keys.map(str::to_owned);
        let commanding = Commanding { commander, person, ..commanding() };
        let order = r#"{"member":"nobody","command":{"command":"write","input":"start","value":"true"},"owner":"bob","reason":"a test"}"#;
        let asking = if is_logged_in {
            let page = Page::with(&folder, commanding);
            spawn(move || {
                let session = cookie(&page.log_in(OPERATOR));
                page.ask("POST", "/api/command", &session, order)
            })
        } else {
            let settings = Settings {
                run: folder.join("nothing"),
                commanding,
                place: Place {
                    address: "127.0.0.1:0".parse().expect("an address"),
                    logins: None,
                    certificate: None,
                    names: Vec::new(),
                },
            };
            let served = serve(settings).expect("served");
            spawn(move || {
                let url = served.url();
                let host = url.trim_start_matches("http://").trim_end_matches('/');
                let request = format!(
                    "POST /api/command HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{order}",
                    order.len()
                );
                let mut stream = TcpStream::connect(host).expect("it listens");
                stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a timeout");
                stream.write_all(request.as_bytes()).expect("sent");
                let mut answer = String::new();
                stream.read_to_string(&mut answer).expect("text");
                answer
            })
        };
        // The member does not exist, so the order is recorded as refused.
        let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
        let commanded = runtime.block_on(commands.next());
        let OperatorAction::Refused(refused) = &commanded.action else {
            panic!("{commanded:?}");
        };
        assert_eq!(refused.owner, expected, "{of_keys:?}, {is_logged_in}");
        commanded.answer(Ok(Done::default()));
        let answer = asking.join().expect("an answer");
        assert!(answer.contains("404") && answer.contains("U0681"), "{answer}");
    }
}

#[test]
fn nothing_is_said_in_the_clear() {
    let page = Page::start(&empty_folder("clear"));
    let mut stream = TcpStream::connect(page.address).expect("it listens");
    let patience = Some(Duration::from_secs(60));
    stream.set_read_timeout(patience).expect("a timeout");
    let request = format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", page.address);
    stream.write_all(request.as_bytes()).expect("sent");
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    assert!(!answer.starts_with(b"HTTP"), "{answer:?}");
}

#[test]
fn other_machines_need_logins_that_are_secret() {
    let folder = empty_folder("rights");
    let settings = |logins| Settings {
        run: folder.join("nothing"),
        commanding: looking(),
        place: Place {
            address: "0.0.0.0:0".parse().expect("an address"),
            logins,
            certificate: None,
            names: Vec::new(),
        },
    };
    assert!(matches!(serve(settings(None)), Err(WatchError::NoLogins(_))));
    let readable = Logins::of_file(&logins_file(&folder, 0o644));
    assert!(matches!(readable, Err(WatchError::Logins { .. })));
    let made = folder.join("made.txt");
    assert!(Logins::of_file(&made).is_ok());
    let rights = fs::metadata(&made).expect("it was made").permissions().mode();
    assert_eq!(rights & 0o777, 0o600);
    let served = serve(settings(Some(Logins::of_file(&made).expect("logins"))));
    let served = served.expect("with logins");
    assert!(served.url().starts_with("https://") && served.fingerprint().is_some());
}
