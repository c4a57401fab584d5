from studio.console.progress import Progress, StageProgress


def test_every_stage_is_a_task_of_its_own():
    shown = []
    stages = StageProgress(Progress(lambda line, final: shown.append((line, final)), every_s=0.0))
    stages(0.5, "poses: features: 8/29")
    stages(0.9, "poses: matching")
    stages(0.1, "training: step 20")
    stages.finish()
    stages.finish()
    lines = [line for line, _ in shown]
    assert lines[0] == "poses …"
    assert lines[1].startswith("poses  50%")
    assert lines[1].endswith("features: 8/29")
    assert [line.split(":")[0] for line, final in shown if final] == ["poses", "training"]
    assert "training …" in lines
