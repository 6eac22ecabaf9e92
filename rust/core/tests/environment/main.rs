//! Episodes, observations, goals and batches.

mod allocation;
mod batch_rows;
mod episodes;
mod goals;
mod randomization;
mod reference;
mod spatial;
