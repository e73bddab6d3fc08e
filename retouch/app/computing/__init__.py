"""What the app's worker processes compute.

Every function takes and returns plain values, which go through a pipe. torch and the models load in the
worker processes, so that the page is up before them and an error of theirs leaves the page alive.

pictures   a picture, and its heights
touch      how heights feel
drafts     what the feel that is chosen would make of them, and how far it can change
results    what a run has made: maps, files for printers, objects
worker     the worker process, and its other end
warnings_kept   what the models warn of meanwhile
"""
