//! Identifiers of NuSMV: letters, digits and `_`, none of its reserved words, each given once.

use std::collections::HashSet;

/// Reserved words of NuSMV 2.6 (its user manual, section 2.1) that are legal names of signals elsewhere.
const RESERVED: &str = "\
    MODULE DEFINE MDEFINE CONSTANTS VAR IVAR FROZENVAR INIT TRANS INVAR SPEC CTLSPEC LTLSPEC PSLSPEC COMPUTE NAME \
    INVARSPEC FAIRNESS JUSTICE COMPASSION ISA ASSIGN CONSTRAINT SIMPWFF CTLWFF LTLWFF PSLWFF COMPWFF IN MIN MAX \
    MIRROR PRED PREDICATES process array of boolean integer real word word1 bool signed unsigned extend resize \
    sizeof uwconst swconst EX AX EF AF EG AG E F O G H X Y Z A U S V T BU EBF ABF EBG ABG case esac mod next init \
    union in xor xnor self TRUE FALSE count abs max min floor main clock noncontinuous time const READ WRITE \
    CONSTARRAY toint typeof wsizeof ISA_ until urgent URGENT PARSYNTH LTLBMC R W D N";

/// Gives names that it has not given before.
#[derive(Debug, Default)]
pub(super) struct Namer {
    taken: HashSet<String>,
}

impl Namer {
    pub(super) fn name(&mut self, wanted: &str) -> String {
        let letters = wanted.chars().map(|character| match character {
            character if character.is_ascii_alphanumeric() => character,
            _ => '_',
        });
        let mut legal: String = letters.collect();
        let starts = legal.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
        if !starts || RESERVED.split(' ').any(|word| word == legal) {
            legal.insert_str(0, "s_");
        }
        let mut name = legal.clone();
        let mut count = 2;
        while !self.taken.insert(name.clone()) {
            name = format!("{legal}_{count}");
            count += 1;
        }
        name
    }
}
