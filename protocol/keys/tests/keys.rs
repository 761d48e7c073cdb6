//! Keys on disk: who gets which, who may read them, and when they no longer count.

#![allow(
    clippy::disallowed_methods,
    reason = "a test that waits for another thread has a deadline"
)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use understudy_cluster::{Cluster, press_cell, read};
use understudy_keys::{
    Authority, DEFAULT_PERSON, Date, KeysError, MemberKeys, OperatorKeys, People, Role,
};
use understudy_seal::{Opener, Refusal};
use understudy_wire::{Body, Frame, Header, Member, Moment, encode};

const DAYS: u32 = 365;

fn cluster() -> Cluster {
    let files = press_cell();
    let loaded = read(files[0].name, files[0].text, &mut |name| {
        let file = files.iter().find(|file| file.name == name);
        Ok(file.expect("the template is whole").text.to_owned())
    });
    loaded.cluster.expect("the template is right")
}

fn now() -> Date {
    "2026-11-21T18:00:00Z".parse().expect("a date")
}

fn empty(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("keys").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old folder goes");
    }
    folder
}

fn names(cluster: &Cluster) -> Vec<String> {
    let members = cluster.members();
    let names = members.filter_map(|member| cluster.member_name(member));
    names.map(str::to_owned).collect()
}

/// An authority that has issued keys to everybody.
fn issued(name: &str) -> (Cluster, Authority) {
    let cluster = cluster();
    let mut authority = Authority::init(&empty(name), &cluster, now()).expect("an empty folder");
    let people = [(DEFAULT_PERSON.to_owned(), understudy_wire::Role::Engineer)];
    authority
        .issue(&cluster, &names(&cluster), people[..].into(), DAYS, now())
        .expect("names of the cluster");
    (cluster, authority)
}

fn load(
    authority: &Authority,
    cluster: &Cluster,
    member: Member,
) -> Result<MemberKeys, Vec<KeysError>> {
    let name = cluster.member_name(member).expect("it is in the cluster");
    MemberKeys::load(&authority.folder_of(name), cluster, member, now())
}

fn loaded(authority: &Authority, cluster: &Cluster, member: Member) -> MemberKeys {
    load(authority, cluster, member).expect("they were just issued")
}

fn codes(errors: &[KeysError]) -> Vec<&'static str> {
    errors.iter().map(KeysError::code).collect()
}

/// Something that any member could say.
fn datagram(cluster: &Cluster, keys: &MemberKeys, sender: Member) -> Vec<u8> {
    let agreement = cluster.agreement();
    let body = match sender {
        Member::Station(_) => Body::Sync,
        Member::RemoteIo(_) => {
            Body::Actuation(understudy_wire::Actuation { outputs: understudy_wire::Image::zero(1) })
        }
        Member::Plant(_) | Member::Twin(_) => Body::Field(understudy_wire::Field {
            sensors: understudy_wire::Image::zero(1),
            handed_over: 0,
            finished: 0,
            plant_faults: 0,
            positions: [].into_iter().collect(),
        }),
    };
    let frame = Frame {
        header: Header {
            cluster: agreement.cluster,
            configuration: agreement.configuration,
            prepared: None,
            moment: Moment::default(),
            sender,
            alone: false,
        },
        body,
    };
    let (mut encoded, mut datagram) = (Vec::new(), Vec::new());
    encode(&frame, &mut encoded).expect("a sensible frame");
    let mut seal = keys.begin_life(now()).expect("a folder of its own");
    seal.seal(&frame, &encoded, &mut datagram).expect("its own frame");
    datagram
}

#[test]
fn each_member_hears_whom_it_has_to_hear_and_has_no_other_key() {
    let (cluster, authority) = issued("each_member");
    let roster = cluster.roster();
    for speaker in cluster.members() {
        let keys = loaded(&authority, &cluster, speaker);
        for listener in cluster.members() {
            let mut said = datagram(&cluster, &keys, speaker);
            let found = loaded(&authority, &cluster, listener).opener().open(&mut said);
            if roster.is_received(speaker, listener) {
                assert!(matches!(found, Ok(Some(_))), "{listener:?} of {speaker:?}: {found:?}");
            } else {
                assert_eq!(found, Err(Refusal::Foreign { sender: speaker }));
            }
        }
    }
}

#[test]
fn nobody_but_the_owner_may_read_any_of_it() {
    let (_, authority) = issued("owner");
    let root = authority.folder_of("robot");
    let root = root.parent().and_then(Path::parent).expect("keys/members/robot");
    let mut folders = vec![root.to_owned()];
    let mut files = 0;
    while let Some(folder) = folders.pop() {
        let mode = fs::metadata(&folder).expect("it is there").permissions().mode();
        assert_eq!(mode & 0o777, 0o700, "{}", folder.display());
        for entry in fs::read_dir(&folder).expect("it is ours") {
            let path = entry.expect("it is ours").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let mode = fs::metadata(&path).expect("it is there").permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{}", path.display());
            files += 1;
        }
    }
    assert_eq!(files, 4 + 8 * 5, "of the authority, of seven members and of an operator");
}

#[test]
fn a_life_never_comes_again() {
    let (cluster, authority) = issued("life");
    let robot = cluster.member("robot").expect("it is in the cluster");
    let keys = loaded(&authority, &cluster, robot);
    let file = authority.folder_of("robot").join("life");
    let life = || -> u32 {
        let text = fs::read_to_string(&file).expect("it was noted");
        text.trim().parse().expect("a number")
    };
    let mut lives = Vec::new();
    let clocks = ["2026-11-21T18:00:00Z", "2026-11-21T18:00:00Z", "1970-01-02T00:00:00Z"];
    for clock in clocks {
        keys.begin_life(clock.parse().expect("a date")).expect("it can be noted");
        lives.push(life());
    }
    // A folder that comes back from a copy has forgotten; the clock has not.
    fs::remove_file(&file).expect("it is ours");
    let clock = "2026-11-21T18:00:09Z".parse().expect("a date");
    keys.begin_life(clock).expect("it can be noted");
    lives.push(life());
    assert!(lives.is_sorted_by(|earlier, later| earlier < later), "{lives:?}");

    for text in ["", "many", "4294967295"] {
        fs::write(&file, text).expect("it is ours");
        let refused = keys.begin_life(now()).expect_err("it is no life");
        assert_eq!(refused.code(), "U0906", "{text:?}");
        assert_eq!(fs::read_to_string(&file).expect("it is ours"), text, "nothing is lost");
    }
}

/// A member that runs refuses the datagrams of a revoked one before long.
fn learns_revocation(
    listening: &mut Opener,
    mut datagram: impl FnMut() -> Vec<u8>,
    sender: Member,
) {
    let started = Instant::now();
    while listening.open(&mut datagram()) != Err(Refusal::Revoked { sender }) {
        assert!(started.elapsed() < Duration::from_secs(30), "it never learns it");
        std::thread::yield_now();
    }
}

#[test]
fn a_revocation_between_loading_and_watching_is_learned() {
    let (cluster, mut authority) = issued("revoked-before-watching");
    let robot = cluster.member("robot").expect("it is in the cluster");
    let press = cluster.member("press").expect("it is in the cluster");
    let stolen = loaded(&authority, &cluster, robot);
    let witness = loaded(&authority, &cluster, press);
    let mut listening = witness.opener();
    authority.revoke(&["robot".to_owned()], now()).expect("it was issued");
    let _watch = witness.watch().expect("a thread");
    learns_revocation(&mut listening, || datagram(&cluster, &stolen, robot), robot);
}

#[test]
fn what_is_revoked_no_longer_counts_and_new_keys_do() {
    let (cluster, mut authority) = issued("revoked");
    let robot = cluster.member("robot").expect("it is in the cluster");
    let press = cluster.member("press").expect("it is in the cluster");
    let stolen = loaded(&authority, &cluster, robot);
    let witness = loaded(&authority, &cluster, press);
    let mut listening = witness.opener();
    let _watch = witness.watch().expect("a thread");
    assert!(listening.open(&mut datagram(&cluster, &stolen, robot)).is_ok());

    let done = authority.revoke(&["robot".to_owned()], now()).expect("it was issued");
    assert_eq!(done.folders.len(), 8);
    let refused = load(&authority, &cluster, robot).expect_err("they are revoked");
    assert_eq!(codes(&refused), ["U0909"]);
    // One that starts now knows it, and one that runs learns it.
    let mut starting = loaded(&authority, &cluster, press).opener();
    let is_revoked = |found| found == Err(Refusal::Revoked { sender: robot });
    assert!(is_revoked(starting.open(&mut datagram(&cluster, &stolen, robot))));
    learns_revocation(&mut listening, || datagram(&cluster, &stolen, robot), robot);
    let again = authority.revoke(&["robot".into(), "nobody".into()], now());
    assert_eq!(codes(&again.expect_err("there is nothing to revoke")), ["U0913", "U0907"]);

    authority
        .issue(&cluster, &["robot".to_owned()], People::default(), DAYS, now())
        .expect("a name of the cluster");
    let fresh = loaded(&authority, &cluster, robot);
    let mut listening = loaded(&authority, &cluster, press).opener();
    assert!(listening.open(&mut datagram(&cluster, &fresh, robot)).is_ok());
    assert_eq!(
        listening.open(&mut datagram(&cluster, &stolen, robot)),
        Err(Refusal::Forged { sender: robot })
    );
    // Whoever has the new list and not yet the new keys still does not hear the old ones.
    let mut behind = witness.opener();
    assert_eq!(
        behind.open(&mut datagram(&cluster, &stolen, robot)),
        Err(Refusal::Revoked { sender: robot })
    );
    assert!(!witness.admitted().members.contains(&"robot.1".to_owned()));
    let members = &loaded(&authority, &cluster, press).tls().members.clone();
    assert!(members.contains(&"robot.2".to_owned()) && !members.contains(&"robot.1".to_owned()));
}

#[test]
fn the_book_is_kept() {
    let (cluster, mut authority) = issued("book");
    authority.revoke(&["arm".to_owned()], now()).expect("it was issued");
    let folder = authority.folder_of("robot");
    let root = folder.parent().and_then(Path::parent).expect("keys/members/robot");
    let again = Authority::open(root).expect("it was made here");
    assert_eq!(again.register(), authority.register());
    let holders = &again.register().holders;
    assert_eq!(holders.len(), 8);
    assert!(holders.iter().all(|holder| holder.expires == now().plus_days(DAYS)));
    let engineers = holders.iter().filter(|holder| holder.role == Role::Engineer);
    assert_eq!(engineers.count(), 1);
    let made = Authority::init(root, &cluster, now());
    assert_eq!(made.err().map(|error| error.code()), Some("U0904"));
    let nowhere = Authority::open(&empty("nowhere"));
    assert_eq!(nowhere.err().map(|errors| codes(&errors)), Some(vec!["U0905"]));
}

#[test]
fn everything_that_is_wrong_is_said_at_once() {
    let (cluster, mut authority) = issued("wrong");
    let robot = cluster.member("robot").expect("it is in the cluster");
    let press = cluster.member("press").expect("it is in the cluster");
    let folder = authority.folder_of("robot");

    let late = now().plus_days(DAYS);
    let refused = MemberKeys::load(&folder, &cluster, robot, late).expect_err("too late");
    assert_eq!(codes(&refused), ["U0908"]);
    let refused = MemberKeys::load(&folder, &cluster, press, now()).expect_err("another's");
    assert_eq!(codes(&refused), ["U0910"]);
    let refused = OperatorKeys::load(&folder, &cluster, now()).expect_err("a member's");
    assert_eq!(codes(&refused), ["U0910"]);
    let operator = authority.folder_of(DEFAULT_PERSON);
    OperatorKeys::load(&operator, &cluster, now()).expect("they were just issued");

    // Clocks may differ by a day; one that is further behind cannot take part in TLS.
    let early =
        |text: &str| MemberKeys::load(&folder, &cluster, robot, text.parse().expect("a date"));
    early("2026-11-20T18:00:00Z").expect("a day before the issue");
    let refused = early("2026-11-20T17:59:59Z").expect_err("too early");
    assert_eq!(codes(&refused), ["U0914"]);
    let said = refused[0].to_string();
    assert!(said.contains("valid from 2026-11-20T18:00:00Z"), "{said}");
    assert!(said.contains("is at 2026-11-20T17:59:59Z"), "{said}");

    let keys = folder.join("keys.toml");
    fs::set_permissions(&keys, fs::Permissions::from_mode(0o644)).expect("it is ours");
    fs::remove_file(folder.join("certificate.pem")).expect("it is ours");
    fs::write(folder.join("revoked.toml"), "revoked = 3").expect("it is ours");
    let refused = MemberKeys::load(&folder, &cluster, robot, late).expect_err("all is wrong");
    assert_eq!(codes(&refused), ["U0903", "U0901", "U0906", "U0908"]);

    let text = fs::read_to_string(&keys).expect("it is ours");
    let key = text.lines().find_map(|line| line.strip_prefix("own = "));
    let key = key.expect("it has one").trim_matches('"').to_owned();
    assert!(refused.iter().all(|error| !error.to_string().contains(&key)), "a secret is shown");

    let nobody = ["robot".to_owned(), "nobody".into(), "no one".into()];
    let refused = authority.issue(
        &cluster,
        &nobody,
        [("press".into(), understudy_wire::Role::Operator)][..].into(),
        DAYS,
        now(),
    );
    assert_eq!(codes(&refused.expect_err("no such names")), ["U0907"; 3]);
    let generation = authority.register().holders[0].generation;
    assert_eq!(generation, 1, "nothing was issued to the one who is known");
}
