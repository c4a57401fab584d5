//! Depth of a photo from several others: `census` (what pixels look like), `sweep` (how unlike they
//! are at each depth), `semi_global` (the depths that are likeliest together).

pub mod census;
pub mod semi_global;
pub mod sweep;
