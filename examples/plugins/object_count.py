"""A panel that counts the objects in the room."""
# ruff: noqa: D101, D102

from PySide6.QtWidgets import QLabel

from studio.app.model.workbench import Topic


def register(studio):
    studio.panel("Object count", ObjectCount)


class ObjectCount(QLabel):
    def __init__(self, bench):
        super().__init__()
        self._bench = bench
        bench.listen(Topic.SCENE, self.show_count)
        self.show_count()

    def show_count(self):
        scene = self._bench.scene
        self.setText("no scene" if scene is None else f"{len(scene.objects)} objects")
