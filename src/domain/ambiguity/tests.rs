use super::*;
use crate::domain::grid::Grid;
use crate::domain::sensor::Finger;
use crate::domain::sim::{self, SimConfig};

#[test]
#[ignore]
fn survey() {
    let seen: Vec<usize> = (0..sim::tools().len()).collect();
    for ambiguous in [true, false] {
        let mut all = Vec::new();
        for k in 0..60u64 {
            let tool = sim::tools()[seen[k as usize % seen.len()]].clone();
            let name = tool.name.clone();
            let tool = if ambiguous { sim::on_a_shaft(tool) } else { tool };
            let config = if k % 2 == 0 { SimConfig::default() } else { SimConfig::randomised(k) };
            let sample = sim::simulate(&tool, sim::random_grasp(k), k, &config);
            for finger in Finger::BOTH {
                let gel = sample.finger(finger).unwrap().gelslim.as_ref().unwrap();
                let a = ambiguity(&gel.difference).unwrap();
                all.push((a.change, a.signal, k, name.clone(), a.direction_rad.to_degrees()));
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        println!("ambiguous {ambiguous}");
        for a in &all {
            println!("{:.3} signal {:.1} k {} {} dir {:.0}", a.0, a.1, a.2, a.3, a.4);
        }
    }
}
