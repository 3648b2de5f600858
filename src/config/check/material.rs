//! Materials, and the variants of them that regions make.

use super::Check;
use super::strength::assumed_cone;
use crate::config::file::RegionKeys;
use crate::config::nearest::{did_you_mean, nearest};
use crate::config::path::Path;
use crate::config::tree::shorten;
use crate::grid::region::{Bounds, Shape, intersection};
use crate::material::cone_fit::ConeFit;
use crate::material::spec::{CONE_FIT, MaterialKeys, MaterialSpec};
use crate::points::seed::Region;
use crate::problem::figure;
use crate::scene::{Kinematics, NamedMaterial};

/// More variants than this come from regions that overlap each other by mistake.
const MAXIMUM_VARIANTS: usize = 10_000;

/// A material of the file, or what regions have made of it.
struct Variant {
    name: String,
    /// The material of the file that regions made it of; `None` where it is that itself.
    made_of: Option<usize>,
    keys: MaterialKeys,
    spec: MaterialSpec,
    /// Whether a body is made of it.
    used: bool,
    /// Where it can occur.
    bounds: Bounds,
}

impl Variant {
    /// Whether the fit of its cone is a word.
    fn has_named_fit(&self) -> bool {
        matches!(self.keys.cone_fit, Some(ConeFit::Named(_)))
    }
}

/// Materials with their specific properties; `density` goes into loads.
pub(super) struct Material {
    pub named: NamedMaterial,
    pub density: Option<f64>,
}

impl Check<'_> {
    /// The laws of the materials of the file, in the order of their names; `None` for those that are wrong.
    pub(super) fn materials(&mut self) -> Vec<Option<MaterialSpec>> {
        let config = self.config;
        let section = Path::root().key("materials");
        let message = "there is no material";
        self.require(
            !config.materials.is_empty(),
            &section,
            message,
            "one material or more, by name",
        );
        let specs = config.materials.iter().map(|(name, keys)| {
            let path = section.key(name);
            self.name(&path, name);
            if !self.sound(&path) {
                return None;
            }
            let resolved = keys.resolve(self.continuum, config.solver.return_map_tolerance);
            resolved
                .map_err(|problems| self.findings.add_keys(self.source, &path, problems))
                .ok()
        });
        specs.collect()
    }

    /// Regions, and the materials of the file followed by the variants that the regions make.
    pub(super) fn regions(&mut self, specs: Vec<Option<MaterialSpec>>) -> (Option<Vec<Material>>, Option<Vec<Region>>) {
        let config = self.config;
        let mut variants = Vec::new();
        let everything = specs.iter().all(Option::is_some);
        for ((name, keys), spec) in config.materials.iter().zip(specs) {
            let used = config.bodies.iter().any(|body| body.material == *name);
            let bounds = ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);
            variants.extend(spec.map(|spec| Variant {
                name: name.clone(),
                made_of: None,
                keys: keys.clone(),
                spec,
                used,
                bounds,
            }));
        }
        if self.kinematics == Kinematics::PlaneStrain {
            let used = variants.iter().filter(|variant| variant.used);
            self.findings
                .warnings
                .extend(used.filter_map(|variant| assumed_cone(&variant.name, &variant.keys, &variant.spec)));
        }
        let mut regions = Vec::new();
        for (index, keys) in config.regions.iter().enumerate() {
            let path = Path::root().key("regions").index(index);
            let shape = self.shape(&path.key("within"), &keys.within);
            // Where a material is wrong, whether it sets a key is not known.
            if everything {
                self.scaled_keys(&path.key("scale"), keys, &variants);
                regions.push(shape.and_then(|shape| self.region(&path, keys, shape, &mut variants)));
            }
        }
        let material = |variant: Variant| Material {
            density: variant.keys.density,
            named: NamedMaterial {
                name: variant.name,
                spec: variant.spec,
                made_of: variant.made_of,
            },
        };
        let materials = everything.then(|| variants.into_iter().map(material).collect());
        (materials, regions.into_iter().collect())
    }

    /// Checks names and factors of the keys that a region scales.
    fn scaled_keys(&mut self, path: &Path, keys: &RegionKeys, variants: &[Variant]) {
        let mut set: Vec<_> = variants
            .iter()
            .filter(|variant| variant.used)
            .flat_map(|variant| variant.keys.numbers_set())
            .collect();
        set.sort_unstable();
        set.dedup();
        // Where the material of a body is wrong, whether it sets a key is not known.
        let bodies = &self.config.bodies;
        let known = bodies
            .iter()
            .all(|body| self.config.materials.contains_key(&body.material));
        for (key, factor) in &keys.scale {
            let place = path.key(key);
            let message = if key == CONE_FIT && variants.iter().any(|variant| variant.used && variant.has_named_fit()) {
                "a cone_fit that is a word cannot be scaled".to_owned()
            } else {
                let hint = did_you_mean(nearest(key, set.iter().copied()));
                format!("no material of a body sets \"{}\"{hint}", shorten(key))
            };
            self.require(set.contains(&key.as_str()) || !known, &place, message, set.join(", "));
            self.require(
                *factor > 0.0,
                &place,
                format!("the factor {} is out of bounds", figure(*factor)),
                "a number > 0",
            );
        }
        self.require(
            !keys.scale.is_empty(),
            path,
            "nothing is scaled",
            "keys of a material with their factors",
        );
    }

    /// A region, with a new variant of each material that can occur in it and sets a key that it scales.
    fn region(&mut self, path: &Path, keys: &RegionKeys, shape: Shape, variants: &mut Vec<Variant>) -> Option<Region> {
        let mut replace = Vec::new();
        let shape_bounds = shape.bounds();
        for from in 0..variants.len() {
            let bounds = intersection(variants[from].bounds, shape_bounds);
            let empty = (0..3).any(|axis| bounds.0[axis] >= bounds.1[axis]);
            let mut scaled = variants[from].keys.clone();
            // A factor out of bounds has been reported.
            let wrong = keys.scale.values().any(|factor| *factor <= 0.0);
            if wrong || !variants[from].used || empty || !scale(&mut scaled, keys) {
                continue;
            }
            let spec = match scaled.resolve(self.continuum, self.config.solver.return_map_tolerance) {
                Ok(spec) => spec,
                Err(problems) => {
                    for problem in problems {
                        let message = format!("scaled, {}: {}: {}", variants[from].name, problem.key, problem.message);
                        self.report(&path.key("scale"), message, problem.expected);
                    }
                    return None;
                }
            };
            let name = format!("{} in {path}", variants[from].name);
            replace.push((from, variants.len()));
            variants.push(Variant {
                name,
                made_of: variants[from].made_of.or(Some(from)),
                keys: scaled,
                spec,
                used: true,
                bounds,
            });
            let message = format!("the regions make more than {MAXIMUM_VARIANTS} variants of the materials");
            if !self.require(
                variants.len() <= MAXIMUM_VARIANTS,
                path,
                message,
                "regions that overlap less",
            ) {
                return None;
            }
        }
        Some(Region { shape, replace })
    }
}

/// Multiplies the keys that are set; returns whether any was.
fn scale(keys: &mut MaterialKeys, region: &RegionKeys) -> bool {
    let mut any = false;
    for (name, value) in keys.numbers_mut() {
        if let Some(factor) = region.scale.get(name) {
            *value *= factor;
            any = true;
        }
    }
    any
}
