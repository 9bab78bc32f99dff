"""The application: a page in the browser on which a structure is built or loaded, solved and looked at.

``limitmason app`` serves it on the loopback address of this machine. Everything the page does is a line of Python that
it shows; the lines run in a process of their own, in the chosen folder, and can be downloaded as a script.
"""
