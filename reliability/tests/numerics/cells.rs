//! Whole cells: against closed forms, against the product of their parts, and against a simulation box by box.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use understudy_reliability::{
    CommonCauseConvention, Networks, Options, RemoteIos, Rule, SharedPart, compare_cells,
};

use crate::support::{check_within, hours, system};

/// Twelve remote I/Os of which some have twins, and one or two networks.
fn cell(twins: u32, networks: u32) -> Options {
    let mut options = Options::new(4, hours(10_000.0), hours(24.0));
    options.remote_ios = Some(RemoteIos {
        count: 4,
        twins,
        mtbf: hours(20_000.0),
        mttr: hours(48.0),
        switchover: 0.95,
        beta: 0.01,
    });
    options.networks =
        Some(Networks { count: networks, mtbf: hours(50_000.0), mttr: hours(8.0), beta: 0.02 });
    options
}

/// A pair with imperfect switchover and common causes, by the two equations of its states.
#[test]
fn a_pair_has_the_mean_of_its_closed_form() {
    for (switchover, beta) in [(1.0, 0.0), (0.9, 0.0), (1.0, 0.05), (0.5, 0.2)] {
        let mut options = Options::new(1, hours(1e15), hours(1e-6));
        options.remote_ios = Some(RemoteIos {
            count: 1,
            twins: 1,
            mtbf: hours(1000.0),
            mttr: hours(10.0),
            switchover,
            beta,
        });
        let (l, m) = (1e-3, 0.1);
        // T0 = 1/(2l + bl) + l(1 + c)/(2l + bl) T1;  T1 = 1/(l + bl + m) + m/(l + bl + m) T0.
        let (all, one) = (2.0 * l + beta * l, l + beta * l + m);
        let masked = l * (1.0 + switchover);
        let wanted = (1.0 + masked / one) / (all - masked * m / one);
        let found = options.system().expect("a system").chain().expect("a chain").mttf();
        check_within(found.expect("a mean"), wanted, 1e-9, "a pair");
        if beta == 0.0 && switchover == 1.0 {
            check_within(wanted, (3.0 * l + m) / (2.0 * l * l), 1e-12, "the textbook");
        }
    }
}

/// With a crew for each box the parts are independent: R(t) is the product of those of the parts.
#[test]
fn a_cell_is_the_product_of_its_parts() {
    let options = cell(3, 2);
    let alone = |change: &dyn Fn(&mut Options)| {
        let mut one = Options::new(1, hours(1e15), hours(1e-6));
        change(&mut one);
        one.system().expect("a system").chain().expect("a chain")
    };
    let them = options.remote_ios.expect("remote I/Os");
    let single = RemoteIos { count: 1, twins: 0, ..them };
    let twin = RemoteIos { count: 1, twins: 1, ..them };
    for t in [10.0, 500.0, 20_000.0] {
        let r = |chain: &understudy_reliability::Chain| chain.reliability(t).expect("R");
        let parts = options.parts_chain().expect("parts").expect("some");
        let stations = system(4, 1, Rule::AsBuilt, 10_000.0, 24.0).chain().expect("a chain");
        let wanted = r(&stations)
            * r(&alone(&|one| one.remote_ios = Some(twin))).powi(3)
            * r(&alone(&|one| one.remote_ios = Some(single)))
            * r(&alone(&|one| one.networks = options.networks));
        check_within(r(&stations) * r(&parts), wanted, 1e-9, "the parts alone");
        let system = options.system().expect("a system");
        check_within(r(&system.chain().expect("a chain")), wanted, 1e-9, "the cell");
        let pairs = r(&system.copies_chain(2).expect("a chain"));
        check_within(system.copies_survival(2, t).expect("R").working, pairs, 1e-9, "the pairs");
    }
}

/// Single parts are shared parts as before, and detection of stations does not delay the repair of a pair.
#[test]
fn single_parts_end_the_cell_with_their_first_failure() {
    let options = cell(0, 1);
    let mut plain = Options::new(4, hours(10_000.0), hours(24.0));
    plain.shared =
        vec![SharedPart::single("all of them", hours(1.0 / (4.0 / 20_000.0 + 1.0 / 50_000.0)))];
    let mean = |options: &Options| {
        options.system().expect("a system").chain().expect("a chain").mttf().expect("a mean")
    };
    check_within(mean(&options), mean(&plain), 1e-11, "in series");
    let mut slow = Options::new(1, hours(1e15), hours(1e-6));
    slow.remote_ios = cell(4, 2).remote_ios;
    let at_once = mean(&slow);
    slow.detection = Some(hours(24.0));
    check_within(mean(&slow), at_once, 1e-9, "detection");
}

#[test]
fn everything_that_is_wrong_with_a_cell_is_reported_together() {
    let mut options = cell(5, 3);
    if let Some(them) = &mut options.remote_ios {
        (them.switchover, them.beta) = (1.5, -0.1);
    }
    let errors = options.system().expect_err("four of them");
    let codes: Vec<&str> = errors.iter().map(|error| error.code()).collect();
    assert_eq!(codes, ["U0704", "U0703", "U0703", "U0704"], "{errors:?}");
}

/// Every redundancy of a cell counts, and a cell without single points lives longer than the best of the others.
#[test]
fn cells_are_compared_with_their_boxes() {
    let rows = compare_cells(&cell(2, 1)).expect("rows");
    let boxes: Vec<u32> = rows.iter().map(|row| row.boxes).collect();
    // 4 + 1 + 6 + 1; 4 + 4 + 1; 8 + 4 + 1; 8 + 8 + 2; 5 + 4 + 1; 5 + 4 + 2; 5 + 8 + 2.
    assert_eq!(boxes, [12, 9, 13, 18, 10, 11, 15]);
    let mean: Vec<f64> = rows.iter().map(|row| row.mttf_hours).collect();
    let [asked, none, pairs, all_pairs, one, networks, all] = mean[..] else { panic!("{mean:?}") };
    assert!(none < pairs && pairs < all_pairs && one < networks && networks < all, "{mean:?}");
    assert!(one < asked && asked < all, "{mean:?}");
    assert!(compare_cells(&Options::new(4, hours(1.0), hours(1.0))).expect("rows").is_empty());
}

/// Each box by itself: up or down, and who of a pair is in charge. What fails the cell is decided from these alone.
fn simulated(options: &Options, runs: u32, seed: u64) -> f64 {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let them = options.remote_ios.expect("remote I/Os");
    let nets = options.networks.expect("networks");
    let controllers = options.controllers as usize;
    let mut sum = 0.0;
    for _ in 0..runs {
        // The last station is the understudy.
        let mut stations = vec![true; controllers + 1];
        let mut ios: Vec<Vec<bool>> = (0..them.count)
            .map(|program| vec![true; if program < them.twins { 2 } else { 1 }])
            .collect();
        let mut in_charge = vec![0_usize; ios.len()];
        let mut networks = vec![true; nets.count as usize];
        let mut now = 0.0;
        loop {
            let mut events: Vec<(f64, usize, usize, usize)> = Vec::new();
            let rate = |up: bool, mtbf: f64, mttr: f64| 1.0 / if up { mtbf } else { mttr };
            for (place, up) in stations.iter().enumerate() {
                events.push((rate(*up, options.mtbf.get(), options.mttr.get()), 0, place, 0));
            }
            for (program, pair) in ios.iter().enumerate() {
                for (place, up) in pair.iter().enumerate() {
                    events.push((rate(*up, them.mtbf.get(), them.mttr.get()), 1, program, place));
                }
                if pair.len() > 1 {
                    events.push((them.beta / them.mtbf.get(), 3, program, 0));
                }
            }
            for (place, up) in networks.iter().enumerate() {
                events.push((rate(*up, nets.mtbf.get(), nets.mttr.get()), 2, place, 0));
            }
            if networks.len() > 1 {
                events.push((nets.beta / nets.mtbf.get(), 3, 0, 0));
            }
            let total: f64 = events.iter().map(|event| event.0).sum();
            now -= (1.0 - random.random::<f64>()).ln() / total;
            let mut at = random.random::<f64>() * total;
            let chosen = events.iter().find(|event| {
                at -= event.0;
                at <= 0.0
            });
            let &(_, what, place, of_pair) = chosen.unwrap_or(&events[0]);
            match what {
                0 => stations[place] = !stations[place],
                1 => {
                    let up = ios[place][of_pair];
                    ios[place][of_pair] = !up;
                    let leads = in_charge[place] == of_pair;
                    if up && leads && ios[place].contains(&true) {
                        if random.random::<f64>() >= them.switchover {
                            break;
                        }
                        in_charge[place] = 1 - of_pair;
                    }
                }
                2 => networks[place] = !networks[place],
                _ => break,
            }
            let failed_stations =
                !stations[controllers] && stations[..controllers].contains(&false);
            let failed_io = ios.iter().any(|pair| !pair.contains(&true));
            if failed_stations || failed_io || !networks.contains(&true) {
                break;
            }
        }
        sum += now;
    }
    sum / f64::from(runs)
}

/// 3,000 lives each; their mean has a standard deviation of 1.8 %.
#[test]
fn a_cell_agrees_with_a_simulation_box_by_box() {
    for (twins, networks, seed) in [(0, 1, 1), (2, 2, 2), (4, 2, 3)] {
        let mut options = cell(twins, networks);
        options.mtbf = hours(1_000.0);
        options.convention = CommonCauseConvention::Additive;
        if let Some(them) = &mut options.remote_ios {
            (them.mtbf, them.switchover, them.beta) = (hours(2_000.0), 0.9, 0.03);
        }
        let chain = options.system().expect("a system").chain().expect("a chain");
        let (model, found) = (chain.mttf().expect("a mean"), simulated(&options, 3_000, seed));
        assert!((model / found - 1.0).abs() < 0.06, "{twins} twins: {found} h, model {model} h");
    }
}
