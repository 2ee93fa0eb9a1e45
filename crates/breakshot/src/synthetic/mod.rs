//! Generators of synthetic data with known truth, for tests, benchmarks and tutorials; not part of the product.

pub mod campaign;
pub mod film;
mod striker;
