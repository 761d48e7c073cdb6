//! What a run left behind: its journal, as records and as the picture that is made of them, and the findings of campaigns.

use std::sync::Arc;

use understudy_campaigns::{Findings, merge};
use understudy_cycle::Mode;
use understudy_journal::records;
use understudy_testing::press_cell;
use understudy_view::{Bounds, Model};

use crate::attack::attack;

#[test]
fn journal() {
    let cluster = Arc::new(press_cell(Mode::Full));
    attack("journal", &[], |bytes| {
        let mut model = Model::new(Arc::clone(&cluster), Bounds::default());
        for record in records(bytes).map_while(Result::ok) {
            model.note(&record);
        }
        let _ = model.snapshot();
        for signal in ["robot.grip", "press.move_up"] {
            let _ = model.why(signal, None);
        }
    });
}

#[test]
fn findings() {
    attack("findings", &[], |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let Ok(findings) = Findings::parse(&text) else {
            return;
        };
        // Nothing that JSON can say is lost.
        let again = Findings::parse(&findings.to_json()).map(|again| again.to_json());
        assert_eq!(again.ok(), Some(findings.to_json()));
        let shards = ["a", "b"].map(|name| (name.to_owned(), findings.clone()));
        let _ = merge(shards.to_vec());
        let _ = merge(vec![("a".to_owned(), findings)]);
    });
}
