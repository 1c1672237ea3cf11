"""Compare one network with four modules, from Python: the example of the README."""

from exneat_cli.runs import RunSettings, train
from exneat_cli.tasks import TrackMaze
from exneat_cli.wiring import Geometry

task = TrackMaze(size=17, gap=2)
network = RunSettings(task=task, algorithm="neat", generations=10, episodes=10)
modules = RunSettings(task=task, algorithm="exneat", geometry=Geometry("single"), generations=10, episodes=10)
for settings in (network, modules):
    finished = train(settings)
    print(finished.directory.path, finished.summary, sep="\n")
