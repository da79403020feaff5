from tcs.model.robots import load_robot, robot_names
from tcs.model.scene import environment_names, load_environment
from tcs.model.tasks import load_task, task_names


def test_list_knows_what_ships(tcs_command):
    ran = tcs_command("list", "--json")
    assert ran.code == 0
    known = ran.json
    assert tuple(task["name"] for task in known["tasks"]) == task_names()
    assert (
        tuple(environment["name"] for environment in known["environments"]) == environment_names()
    )
    assert tuple(robot["name"] for robot in known["robots"]) == robot_names()


def test_headings_are_those_of_the_checked_files(tcs_command):
    known = tcs_command("list", "--json").json
    for entry in known["tasks"]:
        task = load_task(entry["name"])
        assert (task.name, task.title, len(task.goals), list(task.environments)) == (
            entry["name"],
            entry["title"],
            entry["goals"],
            entry["environments"],
        )
    for entry in known["environments"]:
        environment = load_environment(entry["name"])
        assert (environment.title, " ".join(environment.origin.split())) == (
            entry["title"],
            entry["origin"],
        )
    for entry in known["robots"]:
        assert load_robot(entry["name"]).title == entry["title"]


def test_list_as_text(tcs_command):
    ran = tcs_command("list")
    assert ran.code == 0
    assert ran.err == ""
    for word in ("shaving", "wheelchair", "pr2", "where the person faces", "goals"):
        assert word in ran.out


def test_damaged_data_is_one_line(tcs_command, tmp_path, monkeypatch):
    for part in ("tasks/adl", "models/robots", "models/beds_wheelchairs"):
        (tmp_path / part).mkdir(parents=True)
    (tmp_path / "models/robots/r2.yaml").write_text("name: r2\n")
    monkeypatch.setattr("tcs.model.catalogue.data_folder", lambda: tmp_path)
    ran = tcs_command("list")
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert "r2.yaml' lacks one of: title. Install tcs again." in ran.err


def test_version(tcs_command):
    ran = tcs_command("--version")
    assert ran.code == 0
    assert ran.out.strip()[0].isdigit()
