//! The certificate of the page: a given one, or a self-signed one that is made for this run.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, PrivatePkcs8KeyDer};
use tokio_rustls::TlsAcceptor;

use crate::error::WatchError;

/// Files of a certificate chain and of its key, both in PEM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Certificate {
    /// The chain, the page's own certificate first.
    pub chain: PathBuf,
    /// The private key of that certificate.
    pub key: PathBuf,
}

/// What the page shows that it is itself, and the fingerprint of its certificate, to be compared with what a browser warns of.
pub(crate) fn acceptor(
    certificate: Option<&Certificate>,
    address: SocketAddr,
    names: &[String],
) -> Result<(TlsAcceptor, String), WatchError> {
    let bad = |error: &dyn std::fmt::Display| WatchError::Certificate(error.to_string());
    let (chain, key) = match certificate {
        Some(files) => {
            let chain = CertificateDer::pem_file_iter(&files.chain)
                .and_then(Iterator::collect)
                .map_err(|error| bad(&format!("{}: {error}", files.chain.display())))?;
            let key = PrivateKeyDer::from_pem_file(&files.key)
                .map_err(|error| bad(&format!("{}: {error}", files.key.display())))?;
            (chain, key)
        }
        None => {
            let own = [address.ip().to_string(), "localhost".to_owned()];
            let names: Vec<String> = names.iter().cloned().chain(own).collect();
            let made = rcgen::generate_simple_self_signed(names).map_err(|error| bad(&error))?;
            let key = PrivatePkcs8KeyDer::from(made.signing_key.serialize_der());
            (vec![made.cert.der().clone()], PrivateKeyDer::Pkcs8(key))
        }
    };
    let first: &CertificateDer<'_> =
        chain.first().ok_or_else(|| bad(&"the file holds no certificate"))?;
    let digest = ring::digest::digest(&ring::digest::SHA256, first);
    let bytes: Vec<String> = digest.as_ref().iter().map(|byte| format!("{byte:02X}")).collect();
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = rustls::ServerConfig::builder_with_provider(provider)
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| bad(&error))?
        .with_no_client_auth()
        .with_single_cert(chain, key)
        .map_err(|error| bad(&error))?;
    Ok((TlsAcceptor::from(Arc::new(config)), bytes.join(":")))
}
