//! Laws, accuracy and control of the minimal model.

mod allocation;
mod control;
mod mechanics;
mod reference;
mod robots;
mod stage;
