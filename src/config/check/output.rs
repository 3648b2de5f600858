//! What a run writes, and where.

use super::Check;
use crate::condition::dirichlet::Component;
use crate::config::file::{BoundaryComponentKeys, FieldName, HistoryKeys};
use crate::config::path::Path;
use crate::config::write;
use crate::console;
use crate::grid::mesh::MeshFace;
use crate::scene::{HistoryColumn, HistoryQuantity, Kinematics, OutputSettings, PointField, Reduction, Target};

/// Columns that `history.csv` always has.
const FIXED_COLUMNS: [&str; 5] = ["step", "stage", "load_factor", "step_size", "newton_iterations"];

const QUANTITIES: &str = "exactly one of reaction, boundary_motion, max, min, mean, load_factor";

const CLASSICAL_FIELDS: &str = "displacement, position, chi, pressure, von_mises, stress, volume";

const UNDAMAGED_FIELDS: &str = "a field that every continuum has, such as chi";

impl Check<'_> {
    pub(super) fn output(&mut self) -> Option<OutputSettings> {
        let keys = &self.config.output;
        let path = Path::root().key("output");
        let every = keys.snapshots.as_ref().map(|snapshots| snapshots.every);
        let place = path.key("snapshots").key("every");
        self.require(
            every != Some(0),
            &place,
            "0 steps between snapshots",
            "a whole number >= 1",
        );
        let checkpoint_every = keys.checkpoint.as_ref().map(|checkpoint| checkpoint.every);
        let place = path.key("checkpoint").key("every");
        self.require(
            checkpoint_every != Some(0),
            &place,
            "0 steps between checkpoints",
            "a whole number >= 1",
        );
        let directory = keys.directory.clone().unwrap_or_else(|| self.files.default_directory());
        let named = !directory.trim().is_empty() && !directory.contains(console::is_command);
        let expected = "a folder, without control characters in its name";
        self.require(named, &path.key("directory"), "this cannot be a folder", expected);
        let history = self.history(&path.key("history"));
        let resolved_tree = write::resolved(self.config, self.files, &directory);
        Some(OutputSettings {
            directory: directory.into(),
            snapshot_every: every,
            checkpoint_every,
            history: history?,
            report: keys.report,
            resolved: write::text(&resolved_tree),
            resolved_tree,
        })
    }

    fn history(&mut self, section: &Path) -> Option<Vec<HistoryColumn>> {
        let config = self.config;
        let mut taken: Vec<String> = FIXED_COLUMNS.map(str::to_owned).to_vec();
        let mut columns = Vec::new();
        for (index, keys) in config.output.history.iter().enumerate() {
            let path = section.index(index);
            self.name(&path.key("name"), &keys.name);
            let quantity = self.quantity(&path, keys);
            let column = quantity.map(|quantity| HistoryColumn {
                name: keys.name.clone(),
                quantity,
            });
            let kinematics = self.kinematics;
            for name in column.iter().flat_map(|column| column.column_names(kinematics)) {
                let message = format!("there is another column \"{name}\"");
                self.require(!taken.contains(&name), &path.key("name"), message, "a name of its own");
                taken.push(name);
            }
            columns.push(column);
        }
        columns.into_iter().collect()
    }

    fn quantity(&mut self, path: &Path, keys: &HistoryKeys) -> Option<HistoryQuantity> {
        let field = [("max", keys.max), ("min", keys.min), ("mean", keys.mean)];
        let given = field.iter().filter(|(_, field)| field.is_some()).count()
            + usize::from(keys.reaction.is_some())
            + usize::from(keys.boundary_motion.is_some())
            + usize::from(keys.load_factor.is_some());
        if !self.require(given == 1, path, format!("{given} quantities for one name"), QUANTITIES) {
            return None;
        }
        let reduced = field.iter().find_map(|(key, field)| Some((*key, (*field)?)));
        let message = "only a field of the points is taken at a selection";
        self.require(
            keys.at.is_none() || reduced.is_some(),
            &path.key("at"),
            message,
            "at with max, min or mean",
        );
        if let Some((key, field)) = reduced {
            return self.point_quantity(path, key, field, keys);
        }
        if let Some(keys) = &keys.reaction {
            let (boundary, component) = self.boundary_component(&path.key("reaction"), keys)?;
            return Some(HistoryQuantity::Reaction { boundary, component });
        }
        if let Some(keys) = &keys.boundary_motion {
            return self.boundary_motion(&path.key("boundary_motion"), keys);
        }
        let load = self.named_load(&path.key("load_factor"), keys.load_factor.as_ref()?)?;
        Some(HistoryQuantity::LoadFactor { load })
    }

    fn point_quantity(
        &mut self,
        path: &Path,
        key: &str,
        field: FieldName,
        keys: &HistoryKeys,
    ) -> Option<HistoryQuantity> {
        let at = match &keys.at {
            Some(at) => match self.target(&path.key("at"), at)? {
                Target::Points(selection) => Some(selection),
                Target::Face(face) => return self.mean_of_face(&path.key(key), key, field, face),
            },
            None => None,
        };
        let reduction = match key {
            "max" => Reduction::Maximum,
            "min" => Reduction::Minimum,
            _ => Reduction::Mean,
        };
        if of_rotations(field) && !self.require_rotations(&path.key(key), CLASSICAL_FIELDS) {
            return None;
        }
        let of_damage = matches!(field, FieldName::Alpha | FieldName::Damage);
        if of_damage && !self.require_damage(&path.key(key), UNDAMAGED_FIELDS) {
            return None;
        }
        let out_of_plane = matches!(field, FieldName::TwistX | FieldName::TwistY);
        let exists = !(out_of_plane && self.kinematics == Kinematics::PlaneStrain);
        let exists = self.require(exists, &path.key(key), "plane strain turns about z only", "twist_z");
        exists.then_some(HistoryQuantity::Points {
            reduction,
            field: point_field(field),
            at,
        })
    }

    /// Nodes of a face know where they are, and no more.
    fn mean_of_face(&mut self, path: &Path, key: &str, field: FieldName, face: MeshFace) -> Option<HistoryQuantity> {
        let known = matches!(field, FieldName::Displacement | FieldName::Position) && key == "mean";
        let message = "this is not known on a face of the mesh";
        let field = point_field(field);
        self.require(known, path, message, "mean of displacement or position")
            .then_some(HistoryQuantity::FaceMean { field, face })
    }

    fn boundary_component(&mut self, path: &Path, keys: &BoundaryComponentKeys) -> Option<(usize, Component)> {
        let config = self.config;
        let named = config
            .boundary
            .iter()
            .enumerate()
            .filter_map(|(index, entry)| Some((index, entry.name.as_deref()?)));
        let (indices, names): (Vec<_>, Vec<_>) = named.unzip();
        let boundary = self.lookup(&path.key("boundary"), &keys.boundary, "boundary", "boundary", &names);
        let component = self.component(&path.key("component"), &keys.component);
        Some((indices[boundary?], component?))
    }

    fn boundary_motion(&mut self, path: &Path, keys: &BoundaryComponentKeys) -> Option<HistoryQuantity> {
        let (boundary, component) = self.boundary_component(path, keys)?;
        let entry = &self.config.boundary[boundary];
        let prescribed = entry.fix.contains(&keys.component) || entry.moves.contains_key(&keys.component);
        // Where what it prescribes is wrong, it is not known.
        let place = Path::root().key("boundary").index(boundary);
        let known = self.sound(&place.key("fix")) && self.sound(&place.key("move"));
        let message = format!("the boundary \"{}\" leaves {} free", keys.boundary, keys.component);
        let right = self.require(
            prescribed || !known,
            &path.key("component"),
            message,
            "a component that it fixes or moves",
        );
        right.then_some(HistoryQuantity::BoundaryMotion { boundary, component })
    }
}

/// Whether only points that rotate have the field.
fn of_rotations(field: FieldName) -> bool {
    match field {
        FieldName::Rotation | FieldName::TwistX | FieldName::TwistY | FieldName::TwistZ => true,
        FieldName::CoupleStress | FieldName::Wryness => true,
        FieldName::Displacement | FieldName::Position | FieldName::Chi | FieldName::Pressure => false,
        FieldName::VonMises | FieldName::Stress | FieldName::Volume => false,
        FieldName::Alpha | FieldName::Damage => false,
    }
}

fn point_field(name: FieldName) -> PointField {
    match name {
        FieldName::Displacement => PointField::Displacement,
        FieldName::Position => PointField::Position,
        FieldName::Rotation => PointField::Rotation,
        FieldName::TwistX => PointField::TwistX,
        FieldName::TwistY => PointField::TwistY,
        FieldName::TwistZ => PointField::TwistZ,
        FieldName::Chi => PointField::Chi,
        FieldName::Alpha => PointField::Alpha,
        FieldName::Damage => PointField::Damage,
        FieldName::Pressure => PointField::Pressure,
        FieldName::VonMises => PointField::VonMises,
        FieldName::Stress => PointField::Stress,
        FieldName::CoupleStress => PointField::CoupleStress,
        FieldName::Wryness => PointField::Wryness,
        FieldName::Volume => PointField::Volume,
    }
}
