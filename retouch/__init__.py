"""Retouch from Python: touch, sight, optimisation and export by one import.

Importing this package loads none of them; each name loads what it needs when it is first used.
"""

import sys
from typing import TYPE_CHECKING

from relief.ground.lazy import lazy_names

if TYPE_CHECKING:
    from optimize.estimates.forecast import Forecast
    from optimize.runs.job import Result
    from optimize.settings.run_file import Run, load_run, run_from_scene
    from optimize.settings.skins import load_skin
    from relief.ground.errors import InputError
    from relief.ground.progress import Progress, progress
    from relief.heightmap import load_heights, save_heights_exr, save_heights_png
    from relief.preparing.preparation import Prepared, prepare
    from relief.relief import Relief
    from relief.solids.export.plate import export_plate
    from retouch.laboratory.stimulus_sets.making import StimulusPlates
    from retouch.verbs.answering import PeoplesAnswers, answers
    from retouch.verbs.comparison import compare
    from retouch.verbs.evaluation import Evaluation, evaluate, read_solid
    from retouch.verbs.exporting import Exported, export
    from retouch.verbs.learning import DatasetMade, TrainedNet, dataset, train
    from retouch.verbs.machine import Diagnosis, doctor
    from retouch.verbs.objects.wrap_preview import WrapPreview, preview_wrap
    from retouch.verbs.objects.wrapping import WrappedObject, wrap
    from retouch.verbs.previews import save_preview
    from retouch.verbs.rendering import Rendering, explain, render
    from retouch.verbs.runs import forecast, optimize, resume
    from retouch.verbs.scanning import MeasuredPrinter, ScannedPrint, coupon, scan, scan_coupon
    from retouch.verbs.stimulus_plates import redraw_stimuli, stimuli
    from retouch.verbs.studying import StudyTables, list_studies, study
    from surrogate.data.field_set import open_fieldset
    from tactile.area import contact_area
    from tactile.contact import ContactError
    from tactile.jnd import discrimination_probability, jnd_apart, jnd_scaled
    from tactile.model import press
    from tactile.pair_variation import roughness
    from tactile.skin import Skin
    from tactile.touch import Touch
    from visual.scene import Scene, load_scene
    from visual.scene_file.plate_fitting import scene_relief

__all__ = [
    "ContactError",
    "DatasetMade",
    "Diagnosis",
    "Evaluation",
    "Exported",
    "Forecast",
    "InputError",
    "MeasuredPrinter",
    "PeoplesAnswers",
    "Prepared",
    "Progress",
    "Relief",
    "Rendering",
    "Result",
    "Run",
    "ScannedPrint",
    "Scene",
    "Skin",
    "StimulusPlates",
    "StudyTables",
    "Touch",
    "TrainedNet",
    "WrapPreview",
    "WrappedObject",
    "answers",
    "compare",
    "contact_area",
    "coupon",
    "dataset",
    "discrimination_probability",
    "doctor",
    "evaluate",
    "explain",
    "export",
    "export_plate",
    "forecast",
    "jnd_apart",
    "jnd_scaled",
    "list_studies",
    "load_heights",
    "load_run",
    "load_scene",
    "load_skin",
    "open_fieldset",
    "optimize",
    "prepare",
    "press",
    "preview_wrap",
    "progress",
    "read_solid",
    "redraw_stimuli",
    "render",
    "resume",
    "roughness",
    "run_from_scene",
    "save_heights_exr",
    "save_heights_png",
    "save_preview",
    "scan",
    "scan_coupon",
    "scene_relief",
    "stimuli",
    "study",
    "train",
    "wrap",
]

__getattr__, __dir__ = lazy_names(sys.modules[__name__])
