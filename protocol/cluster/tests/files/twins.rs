//! Second remote I/Os: what is wrong with them in a cluster file.

use crate::findings::check;

/// What a twin needs of its device and of its plant, in addresses and names.
#[test]
fn twins() {
    let check = |twin: &str, field: &str, plant: &str| {
        check(&format!(
            "[cluster]\nname = \"cell\"\nperiod = \"10ms\"\n\
             [[controller]]\nname = \"robot\"\nladder = \"robot.ladder\"\naddress = \"10.0.1.11:7450\"\n\
             [[remote_io]]\nname = \"robot-io\"\ncontroller = \"robot\"\ntwin = {{ {twin} }}\n{field}{plant}"
        ))
    };
    let field = |device: &str| format!("[remote_io.field]\nmodbus = \"{device}\"\n");
    let (tcp, serial) = (field("10.0.1.60:502"), field("rtu:/dev/ttyUSB0"));
    let named = |more: &str| format!("name = \"robot-io-2\", wiring = \"exclusive\"{more}");
    assert!(!check(&named(""), &tcp, "").contains("error"));
    let late = ", owner_timeout = \"25ms\", take_over_after";
    assert!(!check(&named(&format!("{late} = 3")), &tcp, "").contains("error"));
    let found = check(&named(&format!("{late} = 2")), &tcp, "");
    assert!(found.contains("U0229") && found.contains("take_over_after = 3"), "{found}");
    assert!(check(&named(""), &serial, "").contains("U0229"));
    assert!(check("wiring = \"exclusive\"", &tcp, "").contains("U0203"), "it has no name");
    assert!(check("name = \"robot-io-2\"", &tcp, "").contains("U0203"), "it has no wiring");
    let parallel = "name = \"robot-io-2\", wiring = \"parallel\"";
    assert!(check(parallel, &tcp, "").contains("U0207"), "it is not built");
    let taken = "name = \"robot-io\", wiring = \"exclusive\"";
    assert!(check(taken, &tcp, "").contains("U0208"));
    let address = named(", address = \"10.0.1.11:7450\"");
    assert!(check(&address, &tcp, "").contains("U0210"));
    for key in ["author = true", "direct = \"10.0.1.61:7450\""] {
        let found = check(&named(&format!(", {key}")), &tcp, "");
        assert!(
            found.contains("U0202"),
            "neither is configured as author, and no link is direct: {found}"
        );
    }
    // A simulated plant must wait until the twin has taken over.
    let plant = |watchdog: u32| {
        format!(
            "[[plant]]\nname = \"arm\"\ncontroller = \"robot\"\nladder = \"belt.ladder\"\nsignals = {{ lots = \"lost\" }}\nwatchdog_cycles = {watchdog}\n"
        )
    };
    for (after, least) in [(1, 4), (3, 6)] {
        let twin = named(&format!(", take_over_after = {after}"));
        let found = check(&twin, "", &plant(least - 1));
        let wanted = format!("watchdog_cycles = {least}");
        assert!(found.contains("U0258") && found.contains(&wanted), "{found}");
        assert!(found.contains("before `robot-io-2` has taken over"), "{found}");
        assert!(!check(&twin, "", &plant(least)).contains("U0258"), "{after}");
    }
}
