from tests.test_stored import write


def test_command_tells_whole_files_from_damaged_ones(tcs_command, tmp_path):
    whole, damaged = write("score file", tmp_path), tmp_path / "cut"
    damaged.write_bytes(whole.read_bytes()[:-100])
    ran = tcs_command("check", damaged, whole)
    assert ran.code == 1
    assert ran.out == f"{whole}: whole, a score file, format 4, pr2, wheelchair, shaving\n"
    assert ran.err.count("\n") == 1
    ran = tcs_command("check", whole, damaged, "--json")
    assert [file["path"] for file in ran.json["damaged"]] == [str(damaged)]
    assert tcs_command("check", whole).code == 0
