//! The same on the scenes of the repository.

use host_sim::Scene;
use host_sim::simulate::simulate;
use std::path::Path;

/// Every effect's bound alone, and what the plan leaves out together.
#[test]
fn bounds_hold_on_the_example_scenes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for entry in std::fs::read_dir(folder).unwrap() {
        let file = entry.unwrap().path();
        let scene = Scene::read(&file).unwrap().resized(12, 9);
        for tolerance in [0.05, 0.01] {
            let found = simulate(&scene, 0, tolerance, true).unwrap();
            let verified = found.verification.unwrap();
            assert!(verified.planned.worst <= tolerance, "{}: {:?}", file.display(), verified.planned);
            for (effect, difference) in &verified.alone {
                let row = found.plan.rows.iter().find(|r| r.effect == *effect).unwrap();
                // Either picture errs by a tenth of the tolerance.
                let most = row.assessment.bound + 0.2 * tolerance;
                assert!(difference.worst <= most, "{}: {} {difference:?}", file.display(), effect.name());
            }
        }
    }
}
