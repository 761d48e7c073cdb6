//! Certificates: ECDSA over P-256, made by rcgen.

use std::net::IpAddr;

use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa,
    Issuer, KeyPair, KeyUsagePurpose, SanType, SerialNumber,
};
use ring::rand::{SecureRandom, SystemRandom};
use time::Duration;

use crate::date::Date;
use crate::error::KeysError;

/// A clock that is behind by less than this takes a new certificate.
const CLOCKS_DIFFER: Duration = Duration::hours(24);

const SERIAL_BYTES: usize = 16;

/// A certificate and its private key, both PEM.
pub(crate) struct Pair {
    pub(crate) certificate: String,
    pub(crate) private_key: String,
    /// Hexadecimal.
    pub(crate) serial: String,
}

/// What stands in a certificate.
pub(crate) struct Subject<'a> {
    pub(crate) cluster: &'a str,
    pub(crate) common_name: &'a str,
    /// Where the holder listens, on each network.
    pub(crate) addresses: Vec<IpAddr>,
    pub(crate) issued: Date,
    pub(crate) expires: Date,
}

/// `N` bytes that nobody can guess.
pub(crate) fn random<const N: usize>(name: &str) -> Result<[u8; N], KeysError> {
    let mut bytes = [0; N];
    SystemRandom::new()
        .fill(&mut bytes)
        .map_err(|_| failed(name)("the system has no random bytes"))?;
    Ok(bytes)
}

/// When a certificate that was issued then begins to hold.
pub(crate) fn begins(issued: Date) -> Date {
    Date::from(issued.inner() - CLOCKS_DIFFER)
}

/// A certificate that signs itself and others.
pub(crate) fn authority(subject: &Subject<'_>) -> Result<Pair, KeysError> {
    let mut parameters = parameters(subject)?;
    parameters.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    parameters.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    let key = key(subject)?;
    let certificate = parameters.self_signed(&key);
    let certificate = certificate.map_err(|error| failed(subject.common_name)(error))?;
    Ok(pair(&parameters, certificate.pem(), &key))
}

/// A certificate for one who calls and is called.
pub(crate) fn holder(
    subject: &Subject<'_>,
    issuer: &Issuer<'_, KeyPair>,
) -> Result<Pair, KeysError> {
    let mut parameters = parameters(subject)?;
    parameters.is_ca = IsCa::ExplicitNoCa;
    parameters.use_authority_key_identifier_extension = true;
    parameters.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    parameters.extended_key_usages =
        vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
    // A laboratory's members are all at home.
    let addresses = subject.addresses.iter().copied().filter(|address| !address.is_unspecified());
    let mut names: Vec<SanType> = addresses.map(SanType::IpAddress).collect();
    if names.is_empty() {
        names.push(SanType::IpAddress(IpAddr::from([127, 0, 0, 1])));
    }
    parameters.subject_alt_names = names;
    let key = key(subject)?;
    let certificate = parameters.signed_by(&key, issuer);
    let certificate = certificate.map_err(|error| failed(subject.common_name)(error))?;
    Ok(pair(&parameters, certificate.pem(), &key))
}

/// Who signs, from what is kept.
pub(crate) fn issuer(
    certificate: &str,
    private_key: &str,
) -> Result<Issuer<'static, KeyPair>, KeysError> {
    let failed = failed("the authority");
    let key = KeyPair::from_pem(private_key).map_err(&failed)?;
    Issuer::from_ca_cert_pem(certificate, key).map_err(failed)
}

fn parameters(subject: &Subject<'_>) -> Result<CertificateParams, KeysError> {
    let mut name = DistinguishedName::new();
    name.push(DnType::OrganizationName, subject.cluster);
    name.push(DnType::CommonName, subject.common_name);
    let mut serial = random::<SERIAL_BYTES>(subject.common_name)?;
    // A serial number is positive, and has no zero in front.
    serial[0] = serial[0] & 0x7f | 0x40;
    let mut parameters = CertificateParams::default();
    parameters.distinguished_name = name;
    parameters.serial_number = Some(SerialNumber::from_slice(&serial));
    parameters.not_before = begins(subject.issued).inner();
    parameters.not_after = subject.expires.inner();
    Ok(parameters)
}

fn key(subject: &Subject<'_>) -> Result<KeyPair, KeysError> {
    KeyPair::generate().map_err(|error| failed(subject.common_name)(error))
}

fn pair(parameters: &CertificateParams, certificate: String, key: &KeyPair) -> Pair {
    let serial = parameters.serial_number.as_ref().map(SerialNumber::to_bytes);
    Pair {
        certificate,
        private_key: key.serialize_pem(),
        serial: crate::files::to_hexadecimal(&serial.unwrap_or_default()),
    }
}

fn failed<E: ToString>(name: &str) -> impl Fn(E) -> KeysError {
    let name = name.to_owned();
    move |reason| KeysError::Certificate { name: name.clone(), reason: reason.to_string() }
}
