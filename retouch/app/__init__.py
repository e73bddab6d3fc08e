"""The app: a page of this machine that makes, feels, runs and compares with the functions of `retouch`.

state      what is being made, apart from any page: the session, its worker processes, its runs
stages     the page, stage by stage, and its elements
page       the frame of a window
routes     heights and files beside the page
guard      who may speak to the server
serve      the server
"""
