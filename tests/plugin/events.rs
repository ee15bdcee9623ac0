//! What an app asks of clay and what it is told: changes, undo, files, trouble.

use super::*;

/// All answers, in order, in words.
#[derive(Resource, Default)]
struct News(Vec<String>);

fn listening() -> App {
    let mut app = app();
    app.init_resource::<News>()
        .add_observer(|news: On<ClayReady>, mut all: ResMut<News>| all.0.push(format!("ready {}", news.entity)))
        .add_observer(|news: On<ClayChanged>, mut all: ResMut<News>| all.0.push(format!("{:?}", news.change)))
        .add_observer(|news: On<ClayExported>, mut all: ResMut<News>| all.0.push(format!("files {}", news.files.len())))
        .add_observer(|news: On<ClayTrouble>, mut all: ResMut<News>| all.0.push(format!("trouble: {}", news.error)))
        .add_observer(|news: On<ClayEngineLost>, mut all: ResMut<News>| all.0.push(format!("lost: {}", news.reason)));
    app
}

/// Asks and waits for an answer that starts so.
fn ask(app: &mut App, answer: &str, ask: impl FnOnce(&mut World)) -> String {
    app.world_mut().resource_mut::<News>().0.clear();
    ask(app.world_mut());
    settle(app, answer, |world| world.resource::<News>().0.iter().any(|news| news.starts_with(answer)));
    app.world().resource::<News>().0.iter().find(|news| news.starts_with(answer)).cloned().expect("an answer")
}

/// The bits of the clay but for what moves, in the order of its particles' ids.
fn bits(app: &App, clay: Entity) -> Vec<u8> {
    let mut state = state(app, clay);
    state.particles.sort_by_key(|p| p.id);
    for particle in &mut state.particles {
        (particle.velocity, particle.affine) = Default::default();
    }
    (state.forecasts, state.time) = (None, 0.0);
    state.to_bytes()
}

/// Presses the clay once, a little deeper and further along with each number, and lifts the tool.
fn stroke(app: &mut App, clay: Entity, tool: Entity, number: u32) {
    let at = |y: f64| (DVec3::new(3.0 + 0.5 * f64::from(number), y, 4.0) * DX).as_vec3();
    app.world_mut().get_mut::<SculptTool>(tool).expect("a tool").is_active = true;
    for y in [6.2, 5.8, 5.4] {
        app.world_mut().get_mut::<Transform>(tool).expect("a tool").translation = at(y);
        tick(app, clay);
    }
    app.world_mut().get_mut::<SculptTool>(tool).expect("a tool").is_active = false;
    let count = |app: &App| app.world().get::<ClayHistory>(clay).expect("a history").undo_count();
    let before = count(app);
    // The stroke is over when nothing has touched the clay for a while.
    for _ in 0..20 {
        tick(app, clay);
    }
    settle(app, "the stroke in the history", |world| world.get::<ClayHistory>(clay).expect("a history").undo_count() > before);
}

/// A cube with a history, and a tool beside it.
fn clay_and_tool(app: &mut App) -> (Entity, Entity) {
    let clay = spawn(app, cube(4, 0.0));
    app.world_mut().entity_mut(clay).insert(ClayHistory::default());
    settle(app, "a history", |world| world.get::<ClayHistory>(clay).is_some_and(|history| history.bytes() > 0));
    let tool = SculptTool { is_active: false, ..SculptTool::ball(2.0 * DX as f32) };
    (clay, app.world_mut().spawn(tool).id())
}

/// Strokes are undone one by one to the start and redone to the end, with the same bits each time.
#[test]
fn strokes_are_undone_and_redone_to_the_bit() {
    let mut app = listening();
    let (clay, tool) = clay_and_tool(&mut app);
    let mut states = vec![bits(&app, clay)];
    for number in 0..3 {
        stroke(&mut app, clay, tool, number);
        states.push(bits(&app, clay));
    }
    assert!(states.windows(2).all(|w| w[0] != w[1]));
    let undo = |app: &mut App, answer: &str| ask(app, answer, |world| world.trigger(UndoClay { entity: clay }));
    let redo = |app: &mut App, answer: &str| ask(app, answer, |world| world.trigger(RedoClay { entity: clay }));
    undo(&mut app, "Undone(2)");
    let third = bits(&app, clay);
    undo(&mut app, "Undone(1)");
    undo(&mut app, "Undone(0)");
    assert!(bits(&app, clay) == states[0], "the start comes back as it was");
    assert!(undo(&mut app, "trouble").contains("nothing to undo"));
    redo(&mut app, "Redone(2)");
    redo(&mut app, "Redone(1)");
    assert!(bits(&app, clay) == third, "redone, the clay has the bits that it was undone to");
    redo(&mut app, "Redone(0)");
    assert!(bits(&app, clay) == states[3], "the end comes back as it was");
    assert!(redo(&mut app, "trouble").contains("nothing to redo"));
    // The clay runs on, and another stroke forgets what was undone.
    undo(&mut app, "Undone(2)");
    stroke(&mut app, clay, tool, 5);
    let history = app.world().get::<ClayHistory>(clay).expect("a history");
    assert_eq!((history.undo_count(), history.redo_count(), history.evicted()), (3, 0, 0));
    assert!(status(&app, clay).error.is_none());
}

/// A history that comes late remembers the clay as it stood then, not as it was loaded.
#[test]
fn late_history_begins_with_the_clay_as_it_stands() {
    let mut app = listening();
    let (clay, tool) = clay_and_tool(&mut app);
    stroke(&mut app, clay, tool, 0);
    let pressed = bits(&app, clay);
    app.world_mut().entity_mut(clay).remove::<ClayHistory>().insert(ClayHistory::default());
    settle(&mut app, "a history", |world| world.get::<ClayHistory>(clay).is_some_and(|history| history.bytes() > 0));
    stroke(&mut app, clay, tool, 1);
    ask(&mut app, "Undone(0)", |world| world.trigger(UndoClay { entity: clay }));
    assert!(bits(&app, clay) == pressed);
}

/// Material and grid are undone with the shape.
#[test]
fn undo_covers_material_and_grid() {
    let mut app = listening();
    let (clay, tool) = clay_and_tool(&mut app);
    stroke(&mut app, clay, tool, 0);
    let stiff = Preset::StiffClay.material();
    app.world_mut().entity_mut(clay).insert(stiff);
    stroke(&mut app, clay, tool, 1);
    let cell_width = 0.8 * DX;
    ask(&mut app, "Resampled", |world| world.trigger(ResampleClay { entity: clay, cell_width }));
    settle(&mut app, "the grid", |world| {
        (world.get::<ClayStatus>(clay).expect("a status").cell_width - cell_width).abs() < 1e-12
    });
    let undo = |app: &mut App, left: usize| {
        ask(app, &format!("Undone({left})"), |world| world.trigger(UndoClay { entity: clay }));
        app.update();
    };
    undo(&mut app, 2);
    assert!((status(&app, clay).cell_width - DX).abs() < 1e-12);
    assert_eq!(app.world().get::<ClayMaterial>(clay), Some(&stiff));
    undo(&mut app, 1);
    assert_eq!(app.world().get::<ClayMaterial>(clay), Some(&Preset::SoftClay.material()));
}

/// A reset brings the start back, and can itself be undone; the clay's material stays.
#[test]
fn reset_is_answered_and_can_be_undone() {
    let mut app = listening();
    let (clay, tool) = clay_and_tool(&mut app);
    let start = bits(&app, clay);
    stroke(&mut app, clay, tool, 0);
    let pressed = bits(&app, clay);
    ask(&mut app, "Reset", |world| world.trigger(ResetClay { entity: clay }));
    assert!(bits(&app, clay) == start);
    ask(&mut app, "Undone(1)", |world| world.trigger(UndoClay { entity: clay }));
    assert!(bits(&app, clay) == pressed);
}

/// What cannot be is answered by its reason, and the clay stays as it is.
#[test]
fn what_cannot_be_done_is_answered() {
    let mut app = listening();
    let clay = spawn(&mut app, cube(2, 0.0));
    let before = bits(&app, clay);
    let no_clay = app.world_mut().spawn_empty().id();
    let trouble = |app: &mut App, event: &dyn Fn(&mut World)| ask(app, "trouble", |world| event(world));
    assert!(trouble(&mut app, &|world| world.trigger(ResetClay { entity: no_clay })).contains("no clay"));
    assert!(trouble(&mut app, &|world| world.trigger(UndoClay { entity: clay })).contains("ClayHistory"));
    assert!(trouble(&mut app, &|world| world.trigger(DropOffcuts { entity: clay })).contains("one piece"));
    for cell_width in [-1.0, f64::NAN, 1e-9] {
        let said = trouble(&mut app, &|world| world.trigger(ResampleClay { entity: clay, cell_width }));
        assert!(said.contains("stays as it is"), "{said}");
    }
    let path = std::path::PathBuf::from("clay.doc");
    let export = |world: &mut World| world.trigger(ExportClay { entity: clay, path: path.clone(), options: default() });
    assert!(trouble(&mut app, &export).contains("clay.doc"));
    assert!(bits(&app, clay) == before);
    tick(&mut app, clay);
    assert_eq!(status(&app, clay).error, None);
}

/// A surface goes into a file, folder and all.
#[test]
fn export_is_answered_with_its_files() {
    let mut app = listening();
    let clay = spawn(&mut app, cube(4, 0.0));
    tick(&mut app, clay);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("new/cube.stl");
    let event = ExportClay { entity: clay, path: path.clone(), options: default() };
    ask(&mut app, "files 1", |world| world.trigger(event));
    assert!(std::fs::metadata(path).expect("a file").len() > 1000);
}
