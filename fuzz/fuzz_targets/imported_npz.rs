#![no_main]

inplace_fuzz::target!();
