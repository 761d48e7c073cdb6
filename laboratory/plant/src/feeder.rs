//! Source of parts: the plant's own feeder, or the plant that feeds it.

/// Puts a part at a place, one at a time.
///
/// Its own supply is endless and puts the next part when the place has been free for `pause_cycles`; parts from another
/// plant are placed at once, and those that come while the place is taken are the model's concern.
#[derive(Debug, Clone, Hash)]
pub(crate) struct Feeder {
    supply: Supply,
}

#[derive(Debug, Clone, Hash)]
enum Supply {
    Own { pause_cycles: u32, free_cycles: u32 },
    OtherPlant,
}

impl Feeder {
    /// `fed` where parts come from another plant. The first part of an own supply is there in the first cycle.
    pub(crate) fn new(fed: bool, pause_cycles: u32) -> Self {
        let supply = if fed {
            Supply::OtherPlant
        } else {
            Supply::Own { pause_cycles, free_cycles: pause_cycles }
        };
        Self { supply }
    }

    /// Parts that come in this cycle, where `arrived` came from another plant and the place is `free` or not.
    pub(crate) fn parts(&mut self, arrived: u64, free: bool) -> u64 {
        match &mut self.supply {
            Supply::OtherPlant => arrived,
            Supply::Own { free_cycles, .. } if !free => {
                *free_cycles = 0;
                0
            }
            Supply::Own { pause_cycles, free_cycles } => {
                if *free_cycles < *pause_cycles {
                    *free_cycles += 1;
                    return 0;
                }
                *free_cycles = 0;
                1
            }
        }
    }
}
