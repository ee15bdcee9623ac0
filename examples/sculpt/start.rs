//! The clay to start with: from a scene file, and with settings that suit the machine.

use crate::args::{Args, EngineArg};
use crate::looks::Looks;
use bevy::prelude::*;
use bevy::render::renderer::RenderAdapterInfo;
use bevy_clay::prelude::*;
use bevy_clay::scene::prelude::*;
use glam::DVec3;
use std::path::{Path, PathBuf};
use wgpu::DeviceType;

/// A block of clay as it comes out of the packet.
const BLOCK: &str = "(
    clay: [Box(size: (0.052, 0.026, 0.040), center: (0, 0.013, 0))],
    cell_width: CELL_WIDTH,
    domain: (low: (-0.06, 0, -0.06), high: (0.06, 0.06, 0.06)),
)";
/// Cell width of the block \[m\]: 46,000 particles.
const BLOCK_CELL: f64 = 0.0021;
/// Most particles to start with where no graphics processor helps.
const PARTICLES_WITHOUT_GPU: f64 = 5000.0;
/// Softening of the clay about a tool: with it a hand leaves marks where it presses and not beside.
const SOFTENING: f64 = 0.5;

/// Puts the clay on the table before anything else is set up.
pub(crate) struct StartPlugin(pub(crate) Start);

impl Plugin for StartPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.0.clone()).add_systems(PreStartup, spawn);
    }
}

/// What was asked for.
#[derive(Resource, Clone, Debug)]
pub(crate) struct Start {
    scene: BuiltScene,
    /// Paths in the scene are from here.
    folder: PathBuf,
    clay: Option<(PathBuf, ClayFile)>,
    engine: EngineArg,
    surface: SurfaceBackend,
    record: Option<PathBuf>,
}

/// The room that the clay takes, for what is put around it.
#[derive(Resource, Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Middle of its box \[m\].
    pub(crate) middle: Vec3,
    /// Half the diagonal of its box \[m\].
    pub(crate) radius: f32,
    /// Height that it stands on \[m\].
    pub(crate) floor: f32,
}

impl Extent {
    fn new(snapshot: &Snapshot) -> Self {
        let positions = snapshot.particles.iter().map(|p| snapshot.domain.to_world(p.grid()));
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = positions.fold(none, |(low, high), at| (low.min(at), high.max(at)));
        Self {
            middle: ((low + high) / 2.0).as_vec3(),
            radius: (high - low).length() as f32 / 2.0,
            floor: snapshot.domain.corners().0.y as f32,
        }
    }
}

impl Start {
    /// Reads the files and builds the scene, to find out whether that can be done.
    ///
    /// # Errors
    /// One line that names file, line and field.
    pub(crate) fn load(args: &Args) -> Result<Self, String> {
        let (scene, folder) = match &args.scene {
            Some(file) => (ClayScene::load(file), file.parent().unwrap_or(Path::new(".")).to_path_buf()),
            None => (ClayScene::from_ron(&BLOCK.replace("CELL_WIDTH", &BLOCK_CELL.to_string())), PathBuf::from(".")),
        };
        let scene = scene.and_then(|scene| scene.build(&folder)).map_err(|e| e.to_string())?;
        let read = |file: &PathBuf| ClayFile::load(file).map(|clay| (file.clone(), clay));
        let clay = args.clay.as_ref().map(read).transpose().map_err(|e| e.to_string())?;
        Ok(Self { scene, folder, clay, engine: args.engine, surface: args.surface.into(), record: args.record.clone() })
    }

    /// The clay as it is, or in coarser cells if there is no graphics processor for so much.
    fn snapshot(&self, has_gpu: bool) -> Snapshot {
        // Filling gives a few particles more than volume over spacing cubed.
        const RESERVE: f64 = 0.94;
        let BuiltScene { scene, snapshot, .. } = &self.scene;
        let excess = snapshot.particles.len() as f64 / PARTICLES_WITHOUT_GPU;
        if has_gpu || excess <= 1.0 {
            return snapshot.clone();
        }
        let cell_width = scene.cell_width * (excess / RESERVE).cbrt();
        let coarse = ClayScene { cell_width, ..scene.clone() };
        match coarse.build(&self.folder) {
            Ok(built) => built.snapshot,
            Err(error) => {
                warn!("the clay stays as fine as it is, and slow: {error}");
                snapshot.clone()
            }
        }
    }

    /// What the clay file says, else the scene's material, softer about tools.
    fn material(&self) -> ClayMaterial {
        let material = ClayMaterial { softening: SOFTENING, ..self.scene.snapshot.material };
        self.clay.as_ref().map_or(material, |(_, clay)| clay.in_place_of(&material))
    }
}

/// Puts the clay on the table.
fn spawn(
    (start, adapter): (Res<Start>, Res<RenderAdapterInfo>),
    mut looks: Looks,
    mut notice: ResMut<ClayNotice>,
    mut commands: Commands,
) {
    start.scene.warnings.iter().for_each(|warning| warn!("{warning}"));
    let has_gpu = adapter.device_type != DeviceType::Cpu && !matches!(start.engine, EngineArg::Native);
    // What is taken back to the start is of this material too.
    let material = start.material();
    let snapshot = Snapshot { material, ..start.snapshot(has_gpu) };
    let (count, name) = (snapshot.particles.len(), &adapter.name);
    notice.say(if has_gpu {
        format!("{count} particles; drawn by {name}")
    } else {
        format!("no graphics processor for the clay ({name}): {count} particles, so that it answers")
    });
    commands.insert_resource(Extent::new(&snapshot));
    let mut clay = commands.spawn((
        Name::new("clay"),
        Clay::snapshot(snapshot),
        ClaySettings { engine: start.engine.into(), surface: start.surface, ..default() },
        material,
        ClayHistory::default(),
    ));
    looks.put_on_clay(&mut clay);
    if let Some(file) = &start.record {
        clay.insert(ClayRecording::new(file));
    }
    if let Some((file, _)) = &start.clay {
        clay.insert(MaterialFile::new(file));
    }
    commands.remove_resource::<Start>();
}
