//! The certificates, judged by rustls: a holder and another one shake hands, a stranger is refused on either side.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::server::WebPkiClientVerifier;
use rustls::{ClientConfig, ClientConnection, RootCertStore, ServerConfig, ServerConnection};
use understudy_cluster::{Cluster, press_cell, read};
use understudy_keys::{Authority, DEFAULT_PERSON, Date};

fn cluster() -> Cluster {
    let files = press_cell();
    let loaded = read(files[0].name, files[0].text, &mut |name| {
        let file = files.iter().find(|file| file.name == name);
        Ok(file.expect("the template is whole").text.to_owned())
    });
    loaded.cluster.expect("the template is right")
}

/// The folders of the robot and of an operator. Certificates are judged by the real clock, so they are made by it.
#[allow(clippy::disallowed_methods, reason = "rustls looks at the clock too")]
fn issued(name: &str) -> (PathBuf, PathBuf) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("tls").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old folder goes");
    }
    let now = Date::of(std::time::SystemTime::now());
    let cluster = cluster();
    let mut authority = Authority::init(&folder, &cluster, now).expect("an empty folder");
    let people = [(DEFAULT_PERSON.to_owned(), understudy_wire::Role::Engineer)];
    authority
        .issue(&cluster, &["robot".to_owned()], people[..].into(), 1, now)
        .expect("a name of the cluster");
    (authority.folder_of("robot"), authority.folder_of(DEFAULT_PERSON))
}

fn chain(folder: &Path) -> (Vec<CertificateDer<'static>>, PrivateKeyDer<'static>) {
    let certificate = CertificateDer::from_pem_file(folder.join("certificate.pem"));
    let key = PrivateKeyDer::from_pem_file(folder.join("private-key.pem"));
    (vec![certificate.expect("a certificate")], key.expect("a key"))
}

fn roots(folder: &Path) -> Arc<RootCertStore> {
    let mut roots = RootCertStore::empty();
    let authority = CertificateDer::from_pem_file(folder.join("authority.pem"));
    roots.add(authority.expect("a certificate")).expect("it is an authority's");
    Arc::new(roots)
}

fn shake_hands(server: &Path, client: &Path, name: &str) -> Result<(), rustls::Error> {
    let _ = rustls::crypto::ring::default_provider().install_default();
    let (certificates, key) = chain(server);
    let verifier = WebPkiClientVerifier::builder(roots(server)).build().expect("it has roots");
    let settings = ServerConfig::builder()
        .with_client_cert_verifier(verifier)
        .with_single_cert(certificates, key)?;
    let mut server = ServerConnection::new(Arc::new(settings))?;
    let (certificates, key) = chain(client);
    let settings = ClientConfig::builder()
        .with_root_certificates(roots(client))
        .with_client_auth_cert(certificates, key)?;
    let name = ServerName::try_from(name.to_owned()).expect("a name");
    let mut client = ClientConnection::new(Arc::new(settings), name)?;
    while client.is_handshaking() || server.is_handshaking() {
        let mut flight = Vec::new();
        while client.wants_write() {
            client.write_tls(&mut flight).expect("it is memory");
        }
        server.read_tls(&mut flight.as_slice()).expect("it is memory");
        server.process_new_packets()?;
        let mut flight = Vec::new();
        while server.wants_write() {
            server.write_tls(&mut flight).expect("it is memory");
        }
        client.read_tls(&mut flight.as_slice()).expect("it is memory");
        client.process_new_packets()?;
    }
    Ok(())
}

#[test]
fn holders_shake_hands_and_strangers_do_not() {
    let (robot, operator) = issued("ours");
    let (their_robot, their_operator) = issued("theirs");
    assert_eq!(shake_hands(&robot, &operator, "127.0.0.1"), Ok(()));
    assert_eq!(shake_hands(&operator, &robot, "127.0.0.1"), Ok(()));
    assert!(shake_hands(&robot, &operator, "127.0.0.2").is_err(), "not its address");
    assert!(shake_hands(&robot, &their_operator, "127.0.0.1").is_err());
    assert!(shake_hands(&their_robot, &operator, "127.0.0.1").is_err());
}
