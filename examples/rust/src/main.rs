// SPDX-License-Identifier: GPL-3.0-or-later
//! Prints every vehicle's position as it arrives: `cargo run -- tcp/localhost:7447`, the router or one vehicle.
//! Fields and units: docs/zenoh-payloads.md.

use zenoh::{Config, Wait};

fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let endpoint = std::env::args().nth(1).unwrap_or("tcp/localhost:7447".into());
    let mut config = Config::default();
    config.insert_json5("mode", "\"client\"")?;
    config.insert_json5("connect/endpoints", &format!("[\"{endpoint}\"]"))?;
    let session = zenoh::open(config).wait()?;
    let positions = session.declare_subscriber("fleet/*/v1/telemetry/position").wait()?;
    while let Ok(sample) = positions.recv() {
        println!("{}: {}", sample.key_expr(), sample.payload().try_to_string()?);
    }
    Ok(())
}
