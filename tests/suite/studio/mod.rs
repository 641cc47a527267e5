//! The studio, spoken to over real connections.

mod client;
mod files;
mod hostile;
mod safety;
mod work;
