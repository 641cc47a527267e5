//! The studio, spoken to over real connections.

mod client;
mod files;
mod safety;
mod work;
