"""The app: a page of this machine that makes, feels, runs and compares with the functions of `retouch`.

session    what is being made, apart from any page
measuring  what a worker process computes of it
runs       runs as processes of the command, followed by their folders
stages     the page, stage by stage
serve      the server, and the guard at its door
"""
