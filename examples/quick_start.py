"""Compare one network with four modules, from Python: the example of the README."""

from exneat_cli.algorithms import NEAT, ExNEAT
from exneat_cli.runs import RunSettings, train
from exneat_cli.tasks import Foraging

for algorithm in (NEAT(), ExNEAT()):
    settings = RunSettings(task=Foraging(), algorithm=algorithm, generations=10, episodes=10)
    finished = train(settings)
    print(finished.directory.path)
    print(finished.summary)
