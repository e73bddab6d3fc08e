"""Retouch from Python: touch, sight, optimisation and export by one import.

Importing this package loads none of them; each name loads what it needs when it is first used.
"""

import sys
from typing import TYPE_CHECKING, Any

from relief.ground.lazy import lazy_names

if TYPE_CHECKING:
    from optimize.estimates.forecast import Forecast as Forecast
    from optimize.runs.job import Result as Result
    from optimize.settings.run_file import Run as Run
    from optimize.settings.run_file import load_run as load_run
    from optimize.settings.run_file import run_from_scene as run_from_scene
    from optimize.settings.skins import load_skin as load_skin
    from relief.ground.errors import InputError as InputError
    from relief.ground.progress import Progress as Progress
    from relief.ground.progress import progress as progress
    from relief.heightmap import load_heights as load_heights
    from relief.heightmap import save_heights_exr as save_heights_exr
    from relief.heightmap import save_heights_png as save_heights_png
    from relief.preparing.picture_preparation import Prepared as Prepared
    from relief.preparing.picture_preparation import prepare as prepare
    from relief.relief import Relief as Relief
    from relief.solids.export.plate_export import export_plate as export_plate
    from retouch.laboratory.stimulus_sets.making import StimulusPlates as StimulusPlates
    from retouch.verbs.answering import PeoplesAnswers as PeoplesAnswers
    from retouch.verbs.answering import answers as answers
    from retouch.verbs.comparison import compare as compare
    from retouch.verbs.evaluation import Evaluation as Evaluation
    from retouch.verbs.evaluation import evaluate as evaluate
    from retouch.verbs.exporting import Exported as Exported
    from retouch.verbs.exporting import export as export
    from retouch.verbs.fuzzy.fuzzing import FuzzyProfile as FuzzyProfile
    from retouch.verbs.fuzzy.fuzzing import fuzzy as fuzzy
    from retouch.verbs.learning import DatasetMade as DatasetMade
    from retouch.verbs.learning import TrainedNet as TrainedNet
    from retouch.verbs.learning import dataset as dataset
    from retouch.verbs.learning import train as train
    from retouch.verbs.machine import Diagnosis as Diagnosis
    from retouch.verbs.machine import doctor as doctor
    from retouch.verbs.objects.wrapping import WrappedObject as WrappedObject
    from retouch.verbs.objects.wrapping import WrapPreview as WrapPreview
    from retouch.verbs.objects.wrapping import preview_wrap as preview_wrap
    from retouch.verbs.objects.wrapping import wrap as wrap
    from retouch.verbs.palettes.palette_fills import PaletteFills as PaletteFills
    from retouch.verbs.palettes.palette_fills import palette as palette
    from retouch.verbs.previews import save_preview as save_preview
    from retouch.verbs.rendering import Rendering as Rendering
    from retouch.verbs.rendering import explain as explain
    from retouch.verbs.rendering import render as render
    from retouch.verbs.runs import forecast as forecast
    from retouch.verbs.runs import optimize as optimize
    from retouch.verbs.runs import resume as resume
    from retouch.verbs.scans.coupons import MeasuredPrinter as MeasuredPrinter
    from retouch.verbs.scans.coupons import coupon as coupon
    from retouch.verbs.scans.coupons import scan_coupon as scan_coupon
    from retouch.verbs.scans.scanning import ScannedPrint as ScannedPrint
    from retouch.verbs.scans.scanning import scan as scan
    from retouch.verbs.solid_evaluation import read_gcode as read_gcode
    from retouch.verbs.solid_evaluation import read_solid as read_solid
    from retouch.verbs.stimulus_plates import redraw_stimuli as redraw_stimuli
    from retouch.verbs.stimulus_plates import stimuli as stimuli
    from retouch.verbs.studying import StudyTables as StudyTables
    from retouch.verbs.studying import list_studies as list_studies
    from retouch.verbs.studying import study as study
    from surrogate.data.field_set import open_fieldset as open_fieldset
    from tactile.contact import ContactError as ContactError
    from tactile.jnd import discrimination_probability as discrimination_probability
    from tactile.jnd import jnd_apart as jnd_apart
    from tactile.jnd import jnd_scaled as jnd_scaled
    from tactile.model import press as press
    from tactile.pair_variation import roughness as roughness
    from tactile.skin import Skin as Skin
    from tactile.touch import Touch as Touch
    from tactile.touch import contact_area as contact_area
    from visual.scene import Scene as Scene
    from visual.scene import load_scene as load_scene
    from visual.scene_file.plate_fitting import scene_relief as scene_relief

_public, __dir__, __all__ = lazy_names(
    sys.modules[__name__], "visual.backend.user_settings:function_of_retouch"
)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        import importlib.metadata  # here, as it takes longer than all else of this import

        return importlib.metadata.version("retouch")
    return _public(name)
